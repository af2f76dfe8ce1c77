from __future__ import annotations

import math

import pytest
import roma
import torch

from motiongen.motion.canonical import GroundFrame, heading
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import pack
from tests.compositions import skeleton
from tests.motion.poses import standing


def random_motion(*shape: int) -> torch.Tensor:
    torch.manual_seed(0)
    rotations = roma.random_rotmat((*shape, 22), dtype=torch.float64)
    return pack(rotations, 10 * torch.randn(*shape, 3, dtype=torch.float64))


def test_round_trip_is_exact():
    motion = random_motion(20, 7)
    frame = GroundFrame.of(motion[:, -1])
    assert (frame.leave(frame.enter(motion)) - motion).abs().max() < 1e-12
    single = motion.float()
    frame = GroundFrame.of(single[:, -1])
    assert (frame.leave(frame.enter(single)) - single).abs().max() < 1e-5


def test_round_trip_in_single_precision_near_the_origin():
    motion = random_motion(20, 7).float()
    motion[..., -3:] /= 10
    frame = GroundFrame.of(motion[:, -1])
    assert (frame.leave(frame.enter(motion)) - motion).abs().max() < 1e-6


def test_the_reference_pose_faces_minus_y_at_the_origin():
    motion = random_motion(20, 7)
    inside = GroundFrame.of(motion[:, -1]).enter(motion)
    assert heading(inside[:, -1]).abs().max() < 1e-6
    assert inside[:, -1, -3:-1].abs().max() < 1e-12
    torch.testing.assert_close(inside[..., -1], motion[..., -1])


def test_standing_faces_minus_y():
    assert heading(standing(1)).item() == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("lean", [0.0, 60.0, 89.0])
def test_heading_survives_leaning_forward(lean):
    pose = standing(1)
    lean_matrix = roma.rotvec_to_rotmat(torch.tensor([math.radians(90 + lean), 0.0, 0.0]))
    pose[..., :6] = lean_matrix[:, :2].T.flatten()
    turned = GroundFrame(torch.tensor(1.1), torch.zeros(2)).leave(pose)
    assert heading(turned).item() == pytest.approx(1.1, abs=1e-5)


def test_heading_of_a_body_that_lies_on_its_side_is_that_of_its_front():
    pose = standing(1)
    lying = roma.euler_to_rotmat("yx", torch.tensor([90.0, 90.0]), degrees=True)
    pose[..., :6] = lying[:, :2].T.flatten()
    turned = GroundFrame(torch.tensor(0.4), torch.zeros(2)).leave(pose)
    assert (heading(turned) - heading(pose)).item() == pytest.approx(0.4, abs=1e-5)


def test_joints_move_rigidly():
    """Entering a frame turns and shifts all joints alike: distances to a fixed point of the frame stay."""
    motion = random_motion(4, 3)
    frame = GroundFrame.of(motion[:, -1])
    before = joint_positions(motion, skeleton())
    before[..., :2] -= frame.origin[:, None, None]
    after = joint_positions(frame.enter(motion), skeleton())
    torch.testing.assert_close(before.norm(dim=-1), after.norm(dim=-1))
    torch.testing.assert_close(before[..., 2], after[..., 2])


def test_ground_points_move_with_the_root():
    motion = random_motion(5, 9)
    frame = GroundFrame.of(motion[:, 0])
    path = motion[..., -3:-1]
    torch.testing.assert_close(frame.enter_ground(path), frame.enter(motion)[..., -3:-1])
    torch.testing.assert_close(frame.leave_ground(frame.enter_ground(path)), path)
