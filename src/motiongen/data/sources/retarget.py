"""From another skeleton's joint frames to SMPL's local rotations, from y up to z up, and to 30 Hz."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from motiongen.data.roots import DataError
from motiongen.motion.representation import pack
from motiongen.motion.resampling import resample
from motiongen.motion.skeleton import PARENTS

FPS = 30.0
LONGEST = 10**6
"""Frames at 30 Hz, nine hours."""
RATES = (0.5, 10000.0)
"""Frames a second that a recording may have."""

WORLD_FROM_Y_UP = torch.tensor([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]], dtype=torch.float64)
"""Rx(90 degrees): y becomes z, z becomes -y."""


def smpl_pose(rotations: Tensor, align: Tensor, pelvis: Tensor) -> tuple[Tensor, Tensor]:
    """Local SMPL rotations in a z-up world.

    Args:
        rotations: (T, 22, 3, 3) world rotations (y up) of the joint frames that stand for SMPL's joints.
        align: (22, 3, 3) those joint frames in SMPL's T-pose, columns in SMPL's axes. Where the body stands in that
            pose, rotations == align, so the local rotations are the identity.
        pelvis: (T, 3) metres, y up.

    Returns:
        Local rotations (T, 22, 3, 3) and pelvis positions (T, 3), z up.
    """
    # With the frames last, a product of small matrices is a few long sums, several times faster than T products.
    turns = rotations.movedim(0, -1).contiguous().numpy()
    world = np.einsum("jabt,jcb->jact", turns, align.numpy())
    local = np.einsum("jbat,jbct->jact", world[list(PARENTS)], world)
    local[0] = np.einsum("ab,bct->act", WORLD_FROM_Y_UP.numpy(), world[0])
    return torch.from_numpy(local).movedim(-1, 0), pelvis @ WORLD_FROM_Y_UP.T


def features(rotations: Tensor, pelvis: Tensor) -> Tensor:
    """The stored form of a pose: (T, 135) float32."""
    return pack(rotations, pelvis).float()


def at_thirty(where: object, local: Tensor, pelvis: Tensor, rate: float) -> tuple[Tensor, Tensor]:
    """Local rotations (T, 22, 3, 3) and pelvis positions (T, 3) of any rate at 30 Hz.

    Raises:
        DataError: no recording has such a rate, or lasts so long.
    """
    if not RATES[0] <= rate <= RATES[1]:
        raise DataError(f"{where}: {rate} frames a second, which no recording has")
    if len(local) * FPS / rate > LONGEST:
        raise DataError(f"{where}: {len(local)} frames, {rate:g} a second, are too long; cut the file")
    # A rate that was rounded in the file, 30.00003 or 119.9995, would cost the last frame.
    rate = round(rate) if abs(rate - round(rate)) < 0.01 else rate
    return (local, pelvis) if rate == FPS else resample(local, pelvis, rate, FPS)


def rotation_between(start: Tensor, end: Tensor) -> Tensor:
    """The smallest rotations (..., 3, 3) that turn vectors (..., 3) into the direction of others, none opposite.

    Rodrigues' formula, with the sine and cosine taken from the cross and dot products.
    """
    start, end = start / start.norm(dim=-1, keepdim=True), end / end.norm(dim=-1, keepdim=True)
    identity = torch.eye(3).to(start).expand(*start.shape, 3)
    # Row i is axis x e_i, which is column i of the matrix that stands for "axis x".
    cross = torch.linalg.cross(torch.linalg.cross(start, end).unsqueeze(-2), identity).transpose(-1, -2)
    cosine = (start * end).sum(dim=-1)[..., None, None]
    return identity + cross + cross @ cross / (1 + cosine)
