"""From our world, z up, to the y-up world of BVH and glTF."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.export.scene import Scene
from motiongen.motion.representation import unpack

Y_UP_FROM_WORLD = torch.tensor([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]], dtype=torch.float64)
"""Rx(-90 degrees): z becomes y, y becomes -z. A body that faces -y in our world faces +z there, as in its T-pose."""


def y_up_pose(scene: Scene) -> tuple[Tensor, Tensor]:
    """Local rotations (T, 22, 3, 3) and pelvis positions (T, 3) in metres, float64, in a world whose y is up.

    SMPL's joint frames are y up already, so only the pelvis turns.
    """
    rotations, pelvis = unpack(scene.features.detach().cpu().double())
    rotations[:, 0] = Y_UP_FROM_WORLD @ rotations[:, 0]
    return rotations, pelvis @ Y_UP_FROM_WORLD.T
