"""Forward kinematics along the 22-joint tree."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import PARENTS, Skeleton


def global_rotations(rotations: Tensor) -> Tensor:
    """Local rotations (..., 22, 3, 3) to world rotations (..., 22, 3, 3)."""
    world = [rotations[..., 0, :, :]]
    for joint, parent in enumerate(PARENTS[1:], start=1):
        world.append(world[parent] @ rotations[..., joint, :, :])
    return torch.stack(world, dim=-3)


def forward_kinematics(rotations: Tensor, translation: Tensor, skeleton: Skeleton) -> tuple[Tensor, Tensor]:
    """Pose a skeleton.

    Args:
        rotations: (..., 22, 3, 3) local rotations.
        translation: (..., 3) world position of the pelvis, metres.

    Returns:
        World rotations (..., 22, 3, 3) and world joint positions (..., 22, 3) in metres.
    """
    world = global_rotations(rotations)
    offsets = skeleton.offsets.to(translation)
    positions = [translation]
    for joint, parent in enumerate(PARENTS[1:], start=1):
        positions.append(positions[parent] + world[..., parent, :, :] @ offsets[joint])
    return world, torch.stack(positions, dim=-2)


def joint_positions(features: Tensor, skeleton: Skeleton) -> Tensor:
    """Features (..., 135) to world joint positions (..., 22, 3), metres."""
    return forward_kinematics(*unpack(features), skeleton)[1]
