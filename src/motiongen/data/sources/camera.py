"""SMPL poses that were estimated from video, in the camera's coordinates: x to the right, y down, z away from it."""

from __future__ import annotations

import numpy as np
import roma
import torch
from torch import Tensor

from motiongen.data.roots import DataError
from motiongen.data.sources.arrays import per_frame
from motiongen.data.sources.retarget import at_thirty, features
from motiongen.motion.kinematics import forward_kinematics
from motiongen.motion.skeleton import JOINTS, Skeleton

WORLD_FROM_CAMERA = torch.tensor([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]], dtype=torch.float64)
"""Rx(-90 degrees): y becomes -z, z becomes y. Who faces the camera faces -y."""
VIBE_JOINTS, VIBE_PELVIS = 49, 8
"""Joints of VIBE's `joints3d` (Kocabas et al. 2020), and the one that is SMPL's pelvis (OpenPose's mid hip)."""
TOE_HEIGHT = 0.025
"""Metres from the floor to the toe joint of one who stands."""


def upright(where: object, turns: Tensor, pelvis: Tensor, skeleton: Skeleton, fps: float) -> Tensor:
    """Features (T', 135) at 30 Hz in a world whose z is up.

    A camera does not tell where the floor is: it is put under the lowest joint of the whole motion.

    Args:
        where: the file, or the place in it, to name in errors.
        turns: (T, 66) axis angles of SMPL's body joints, pelvis first, in the camera's coordinates.
        pelvis: (T, 3) metres, in the same.
        skeleton: whose lowest joint is meant.
        fps: frames per second.
    """
    local = roma.rotvec_to_rotmat(turns.reshape(-1, JOINTS, 3))
    local[:, 0] = WORLD_FROM_CAMERA @ local[:, 0]
    local, position = at_thirty(where, local, pelvis @ WORLD_FROM_CAMERA.T, fps)
    _, joints = forward_kinematics(local, position, skeleton)
    position[:, 2] += TOE_HEIGHT - joints[..., 2].min()
    return features(local, position)


def vibe_pelvis(where: str, joints: object) -> Tensor:
    """SMPL's pelvis (T, 3) among VIBE's `joints3d` (T, 49, 3), metres, in the camera's coordinates.

    Raises:
        DataError: the joints are of another shape or not finite; the message begins with `where`.
    """
    shape = getattr(joints, "shape", ())
    if not isinstance(joints, np.ndarray) or len(shape) != 3 or shape[1:] != (VIBE_JOINTS, 3):
        raise DataError(f"{where}: field 'joints3d' has shape {shape}, not (frames, {VIBE_JOINTS}, 3)")
    return per_frame(where, {"joints3d": joints[:, VIBE_PELVIS]}, "joints3d", 3)
