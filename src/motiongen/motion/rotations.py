"""Rotation forms: the continuous 6D form of Zhou et al. 2019 and yaw. Everything else is in roma."""

from __future__ import annotations

import roma
import torch
from torch import Tensor


def rot6d_from_matrix(rotations: Tensor) -> Tensor:
    """(..., 3, 3) to (..., 6): the first column, then the second."""
    return rotations[..., :2].transpose(-1, -2).flatten(-2)


def matrix_from_rot6d(rot6d: Tensor) -> Tensor:
    """(..., 6) to (..., 3, 3) by Gram-Schmidt, so any two columns that are not parallel give a rotation."""
    return roma.special_gramschmidt(rot6d.unflatten(-1, (2, 3)).transpose(-1, -2))


def yaw_matrix(yaw: Tensor) -> Tensor:
    """(...) radians, counter-clockwise about z, to (..., 3, 3)."""
    cos, sin, zero, one = yaw.cos(), yaw.sin(), torch.zeros_like(yaw), torch.ones_like(yaw)
    return torch.stack([cos, -sin, zero, sin, cos, zero, zero, zero, one], dim=-1).unflatten(-1, (3, 3))
