"""Forward kinematics along the 22-joint tree."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import PARENTS, Skeleton


def global_rotations(rotations: Tensor) -> Tensor:
    """Local rotations (..., 22, 3, 3) to world rotations (..., 22, 3, 3)."""
    # Unbound at once: the gradient of indexing joint by joint would fill the whole tensor with zeros for every joint.
    root, *others = rotations.unbind(-3)
    world = [root]
    for local, parent in zip(others, PARENTS[1:], strict=True):
        world.append(world[parent] @ local)
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
    offsets = skeleton.offsets.to(translation)[1:]
    # Every bone, turned by its parent joint: (..., 21, 3).
    bones = torch.einsum("...jmn,jn->...jm", world[..., list(PARENTS[1:]), :, :], offsets)
    positions = [translation]
    for bone, parent in zip(bones.unbind(-2), PARENTS[1:], strict=True):
        positions.append(positions[parent] + bone)
    return world, torch.stack(positions, dim=-2)


def joint_positions(features: Tensor, skeleton: Skeleton) -> Tensor:
    """Features (..., 135) to world joint positions (..., 22, 3), metres."""
    return forward_kinematics(*unpack(features), skeleton)[1]
