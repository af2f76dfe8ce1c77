"""Rotation forms: the continuous 6D form of Zhou et al. 2019 and yaw. Everything else is in roma."""

from __future__ import annotations

import roma
import torch
from torch import Tensor


def rot6d_from_matrix(rotations: Tensor) -> Tensor:
    """(..., 3, 3) to (..., 6): the first column, then the second."""
    return rotations[..., :2].transpose(-1, -2).flatten(-2)


def matrix_from_rot6d(rot6d: Tensor) -> Tensor:
    """(..., 6) to (..., 3, 3) by Gram-Schmidt, so any two columns that are not parallel give a rotation.

    As roma's `special_gramschmidt`. With the components first in memory, sums over three numbers are a few long sums,
    several times faster; what is returned is so, too.
    """
    first, second = rot6d.movedim(-1, 0).contiguous().unflatten(0, (2, 3))
    x = first / first.square().sum(dim=0).sqrt()
    y = second - (x * second).sum(dim=0) * x
    y = y / y.square().sum(dim=0).sqrt()
    z = torch.linalg.cross(x, y, dim=0)
    return torch.stack([x, y, z], dim=1).movedim((0, 1), (-2, -1))


def share_of(rotations: Tensor, shares: Tensor) -> Tensor:
    """Rotations (..., 3, 3) turned by shares (...) of their angles, the short way: slerp from none."""
    return roma.rotvec_to_rotmat(shares.unsqueeze(-1) * roma.rotmat_to_rotvec(rotations))


def yaw_matrix(yaw: Tensor) -> Tensor:
    """(...) radians, counter-clockwise about z, to (..., 3, 3)."""
    cos, sin, zero, one = yaw.cos(), yaw.sin(), torch.zeros_like(yaw), torch.ones_like(yaw)
    return torch.stack([cos, -sin, zero, sin, cos, zero, zero, zero, one], dim=-1).unflatten(-1, (3, 3))
