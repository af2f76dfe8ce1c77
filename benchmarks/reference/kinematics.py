"""Kinematics and skinning in the style of smplx's `lbs.py`: 4 x 4 matrices, joint by joint, and every vertex."""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor

from motiongen.motion.bodies import Body
from motiongen.motion.skeleton import JOINTS, PARENTS


def rotation_from_6d(numbers: Tensor) -> Tensor:
    """(..., 6) to (..., 3, 3), as in PyTorch3D, but with the two vectors as columns."""
    first, second = numbers[..., :3], numbers[..., 3:]
    one = F.normalize(first, dim=-1)
    two = F.normalize(second - (one * second).sum(-1, keepdim=True) * one, dim=-1)
    return torch.stack((one, two, torch.cross(one, two, dim=-1)), dim=-1)


def rigid_transforms(rotations: Tensor, joints: Tensor) -> tuple[Tensor, Tensor]:
    """Local rotations (N, 22, 3, 3) and rest joints (N, 22, 3) to posed joints and transforms (N, 22, 4, 4)."""
    joints = joints.unsqueeze(-1)
    bones = joints.clone()
    bones[:, 1:] -= joints[:, list(PARENTS[1:])]
    local = torch.cat([F.pad(rotations, [0, 0, 0, 1]), F.pad(bones, [0, 0, 0, 1], value=1)], dim=3)
    chain = [local[:, 0]]
    for joint in range(1, JOINTS):
        chain.append(torch.matmul(chain[PARENTS[joint]], local[:, joint]))
    transforms = torch.stack(chain, dim=1)
    moved = torch.matmul(transforms, F.pad(joints, [0, 0, 0, 1]))
    return transforms[:, :, :3, 3], transforms - F.pad(moved, [3, 0, 0, 0, 0, 0, 0, 0])


def posed_joints(rotations: Tensor, joints: Tensor) -> Tensor:
    """Local rotations (N, 22, 3, 3) and rest joints (22, 3) to joints relative to the pelvis (N, 22, 3)."""
    return rigid_transforms(rotations, joints.expand(len(rotations), -1, -1))[0]


def vertices(features: Tensor, body: Body) -> Tensor:
    """Poses (N, 135) to vertices relative to the pelvis (N, V, 3)."""
    count = len(features)
    rotations = rotation_from_6d(features[:, :-3].reshape(count, JOINTS, 6))
    rest = body.rest.expand(count, -1, -1)
    if body.pose_directions is not None:
        turned = (rotations[:, 1:] - torch.eye(3)).reshape(count, -1)
        rest = rest + torch.matmul(turned, body.pose_directions.flatten(0, 1).T).view(count, -1, 3)
    _, transforms = rigid_transforms(rotations, body.rest_joints.expand(count, -1, -1))
    weights = body.weights.expand(count, -1, -1)
    blended = torch.matmul(weights, transforms.view(count, JOINTS, 16)).view(count, -1, 4, 4)
    homogeneous = torch.cat([rest, torch.ones(count, rest.shape[1], 1)], dim=2)
    return torch.matmul(blended, homogeneous.unsqueeze(-1))[:, :, :3, 0]
