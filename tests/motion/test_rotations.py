from __future__ import annotations

import math

import roma
import torch

from motiongen.motion.rotations import matrix_from_rot6d, rot6d_from_matrix, share_of, yaw_matrix


def random_rotations(*shape: int) -> torch.Tensor:
    torch.manual_seed(0)
    return roma.random_rotmat(shape, dtype=torch.float64)


def test_round_trip():
    rotations = random_rotations(50)
    torch.testing.assert_close(matrix_from_rot6d(rot6d_from_matrix(rotations)), rotations)


def test_layout_is_first_column_then_second():
    matrix = torch.arange(9.0).reshape(3, 3)
    assert rot6d_from_matrix(matrix).tolist() == [0, 3, 6, 1, 4, 7]


def test_any_two_directions_give_a_rotation():
    torch.manual_seed(1)
    matrices = matrix_from_rot6d(torch.randn(50, 6, dtype=torch.float64))
    identity = torch.eye(3, dtype=torch.float64).expand(50, 3, 3)
    torch.testing.assert_close(matrices @ matrices.transpose(-1, -2), identity)
    torch.testing.assert_close(torch.linalg.det(matrices), torch.ones(50, dtype=torch.float64))


def test_equals_the_gram_schmidt_of_roma_in_value_and_gradient():
    torch.manual_seed(2)
    rot6d = torch.randn(4, 5, 6, dtype=torch.float64, requires_grad=True)
    weights = torch.randn(4, 5, 3, 3, dtype=torch.float64)
    theirs = roma.special_gramschmidt(rot6d.unflatten(-1, (2, 3)).transpose(-1, -2))
    ours = matrix_from_rot6d(rot6d)
    torch.testing.assert_close(ours, theirs)
    expected, found = (torch.autograd.grad((turns * weights).sum(), rot6d)[0] for turns in (theirs, ours))
    torch.testing.assert_close(found, expected)


def test_gradient_is_finite_at_the_identity():
    rot6d = torch.tensor([1.0, 0, 0, 0, 1, 0], requires_grad=True)
    matrix_from_rot6d(rot6d).sum().backward()
    assert torch.isfinite(rot6d.grad).all()


def test_yaw_is_counter_clockwise_seen_from_above():
    turned = yaw_matrix(torch.tensor(math.pi / 2)) @ torch.tensor([0.0, -1.0, 0.0])
    torch.testing.assert_close(turned, torch.tensor([1.0, 0.0, 0.0]))


def test_shares_of_a_rotation_go_the_short_way():
    quarter = roma.rotvec_to_rotmat(torch.tensor([[0.0, 0.0, math.pi / 2], [0.0, 0.0, 1.5 * math.pi]]))
    got = roma.rotmat_to_rotvec(share_of(quarter, torch.tensor([0.5, 0.5])))[:, 2]
    torch.testing.assert_close(got, torch.tensor([math.pi / 4, -math.pi / 4]))
