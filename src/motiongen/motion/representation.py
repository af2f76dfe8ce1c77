"""A pose as a vector: 22 local rotations in 6D form, then the pelvis' position in the world (135 numbers)."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.motion.rotations import matrix_from_rot6d, rot6d_from_matrix
from motiongen.motion.skeleton import JOINTS

FEATURES = JOINTS * 6 + 3
ROTATION = slice(0, JOINTS * 6)
ROOT_ROTATION = slice(0, 6)
TRANSLATION = slice(JOINTS * 6, FEATURES)


def pack(rotations: Tensor, translation: Tensor) -> Tensor:
    """Local rotations (..., 22, 3, 3) and pelvis positions (..., 3) in metres to features (..., 135)."""
    return torch.cat([rot6d_from_matrix(rotations).flatten(-2), translation], dim=-1)


def unpack(features: Tensor) -> tuple[Tensor, Tensor]:
    """Features (..., 135) to local rotations (..., 22, 3, 3) and pelvis positions (..., 3)."""
    return matrix_from_rot6d(features[..., ROTATION].unflatten(-1, (JOINTS, 6))), features[..., TRANSLATION]
