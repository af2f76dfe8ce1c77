from __future__ import annotations

import roma
import torch
from torch import Tensor

from motiongen.data.sources.retarget import features, rotation_between, smpl_pose
from motiongen.motion.canonical import heading
from motiongen.motion.kinematics import global_rotations
from motiongen.motion.skeleton import JOINTS


def rotations(*shape: int) -> Tensor:
    vectors = torch.randn(*shape, 3, generator=torch.Generator().manual_seed(len(shape)), dtype=torch.float64)
    return roma.rotvec_to_rotmat(vectors)


def test_the_t_pose_has_identity_rotations_and_stands_facing_minus_y() -> None:
    align = rotations(JOINTS)
    local, pelvis = smpl_pose(align[None], align, torch.tensor([[1.0, 0.9, 3.0]], dtype=torch.float64))
    assert torch.allclose(local[0, 1:], torch.eye(3, dtype=torch.float64), atol=1e-9)
    # x to the left, y up and z forward become x, z and -y.
    expected = torch.tensor([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]], dtype=torch.float64)
    assert torch.allclose(local[0, 0], expected, atol=1e-9)
    assert torch.equal(pelvis, torch.tensor([[1.0, -3.0, 0.9]], dtype=torch.float64))
    assert heading(features(local, pelvis)).abs() < 1e-6


def test_world_rotations_are_kept() -> None:
    align, world = rotations(JOINTS), rotations(4, JOINTS)
    local, _ = smpl_pose(world, align, torch.zeros(4, 3, dtype=torch.float64))
    up = roma.euler_to_rotmat("x", torch.tensor([90.0], dtype=torch.float64), degrees=True)
    assert torch.allclose(global_rotations(local), up @ world @ align.mT, atol=1e-6)


def test_the_smallest_rotation_between_directions() -> None:
    generator = torch.Generator().manual_seed(0)
    start, end = torch.randn(2, 50, 3, generator=generator, dtype=torch.float64)
    rotation = rotation_between(start, end)
    assert roma.is_rotation_matrix(rotation, epsilon=1e-9)
    turned = (rotation @ start.unsqueeze(-1)).squeeze(-1)
    assert torch.allclose(torch.nn.functional.cosine_similarity(turned, end), torch.ones(50).double(), atol=1e-9)
    angle = torch.acos(torch.nn.functional.cosine_similarity(start, end))
    assert torch.allclose(roma.rotmat_geodesic_distance(rotation, torch.eye(3).double()), angle, atol=1e-6)
    assert torch.allclose(rotation_between(start, 3 * start), torch.eye(3).double(), atol=1e-9)
