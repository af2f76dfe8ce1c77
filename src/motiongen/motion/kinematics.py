"""Forward kinematics along the 22-joint tree."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import PARENTS, Skeleton


def global_rotations(rotations: Tensor) -> Tensor:
    """Local rotations (..., 22, 3, 3) to world rotations (..., 22, 3, 3)."""
    return _poses_first(_world(_poses_last(rotations)), rotations.shape[:-3])


def forward_kinematics(rotations: Tensor, translation: Tensor, skeleton: Skeleton) -> tuple[Tensor, Tensor]:
    """Pose a skeleton.

    Args:
        rotations: (..., 22, 3, 3) local rotations.
        translation: (..., 3) world position of the pelvis, metres.

    Returns:
        World rotations (..., 22, 3, 3) and world joint positions (..., 22, 3) in metres.
    """
    world = _world(_poses_last(rotations))
    offsets = skeleton.offsets.to(translation)[1:]
    # Every bone, turned by its parent joint: (21, 3, N).
    bones = (world[list(PARENTS[1:])] * offsets[:, None, :, None]).sum(dim=2)
    positions = [translation.reshape(-1, 3).T]
    for bone, parent in zip(bones.unbind(), PARENTS[1:], strict=True):
        positions.append(positions[parent] + bone)
    poses = rotations.shape[:-3]
    return _poses_first(world, poses), _poses_first(torch.stack(positions), poses)


def joint_positions(features: Tensor, skeleton: Skeleton) -> Tensor:
    """Features (..., 135) to world joint positions (..., 22, 3), metres."""
    # In one piece, or the length of every vector made of them would take 20 times as long.
    return forward_kinematics(*unpack(features), skeleton)[1].contiguous()


def _world(local: Tensor) -> Tensor:
    """Local rotations (22, 3, 3, N) to world rotations (22, 3, 3, N).

    With the poses last, a product of small matrices is a few long sums, several times faster than N products.
    """
    # Unbound at once: the gradient of indexing joint by joint would fill the whole tensor with zeros for every joint.
    root, *others = local.unbind()
    world = [root]
    for turn, parent in zip(others, PARENTS[1:], strict=True):
        world.append((world[parent].unsqueeze(2) * turn).sum(dim=1))
    return torch.stack(world)


def _poses_last(rotations: Tensor) -> Tensor:
    """(..., 22, 3, 3) to (22, 3, 3, N)."""
    return rotations.reshape(-1, *rotations.shape[-3:]).movedim(0, -1).contiguous()


def _poses_first(values: Tensor, poses: Sequence[int]) -> Tensor:
    """(22, ..., N) to (*poses, 22, ...)."""
    return values.movedim(-1, 0).reshape(*poses, *values.shape[:-1])
