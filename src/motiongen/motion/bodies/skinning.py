"""Linear blend skinning, differentiable in everything."""

from __future__ import annotations

import torch
from torch import Tensor


def skin(rest: Tensor, weights: Tensor, rotations: Tensor, translations: Tensor) -> Tensor:
    """Blend every joint's transform into every vertex: v' = sum_j w_j (R_j v + t_j).

    Summed column by column of R, so that no (..., V, 3, 3) matrices are ever held: the peak is a few times the result.

    Args:
        rest: (V, 3) or (..., V, 3) vertices of the rest pose, metres.
        weights: (V, J), rows add up to 1.
        rotations: (..., J, 3, 3) world rotations of the joints.
        translations: (..., J, 3), where each joint's transform takes the rest pose's origin.

    Returns:
        (..., V, 3) vertices in the world, metres.
    """
    # With the poses last, blending is one large product for all of them.
    turns, shift, place = _poses_last(rotations, 3), _poses_last(translations, 2), _poses_last(rest, 2)
    posed = (weights @ shift.flatten(1)).unflatten(1, shift.shape[1:])  # (V, 3, N)
    for axis in range(3):
        turned = (weights @ turns[:, :, axis].flatten(1)).unflatten(1, shift.shape[1:])
        posed = posed + place[:, axis, None] * turned
    return posed.movedim(-1, 0).reshape(*translations.shape[:-2], *rest.shape[-2:])


def pose_offsets(directions: Tensor, rotations: Tensor) -> Tensor:
    """Pose-dependent vertex offsets (SMPL, Loper et al. 2015, Eq. 9).

    Args:
        directions: (V, 3, 9 (J - 1)), per entry of every local rotation but the root's, row by row.
        rotations: (..., J, 3, 3) local rotations.

    Returns:
        (..., V, 3) offsets of the rest vertices, metres; zero in the rest pose.
    """
    local = rotations[..., 1:, :, :]
    bent = (local - torch.eye(3).to(local)).flatten(-3)
    vertices, axes, entries = directions.shape
    moved = directions.reshape(vertices * axes, entries) @ _poses_last(bent, 1)
    return moved.movedim(-1, 0).reshape(*bent.shape[:-1], vertices, axes)


def _poses_last(values: Tensor, own: int) -> Tensor:
    """(..., own dimensions) to (own dimensions, N)."""
    return values.reshape(-1, *values.shape[values.ndim - own :]).movedim(0, -1)
