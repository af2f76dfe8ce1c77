import math
from functools import partial

import pytest
import torch

from motiongen.evaluation.metrics.motion import (
    CONTACT_MARGIN,
    foot_skating,
    frozen_share,
    joint_position_error,
    joint_speed,
    resting_heights,
    trajectory_error,
)
from motiongen.motion.skeleton import FEET, JOINT, JOINTS


@pytest.fixture
def mask() -> torch.Tensor:
    return torch.tensor([[True] * 5, [True] * 3 + [False] * 2])


def test_trajectory_error_is_the_distance_on_the_ground_over_valid_frames(mask: torch.Tensor) -> None:
    asked = torch.zeros(2, 5, 2)
    walked = torch.tensor([3.0, 4.0]).expand(2, 5, 2).clone()
    walked[1, 3:] = float("nan")
    assert trajectory_error(walked, asked, mask).tolist() == pytest.approx([5.0, 5.0])


def test_joint_position_error_is_in_centimetres_and_averages_joints_and_valid_frames(mask: torch.Tensor) -> None:
    real = torch.zeros(2, 5, JOINTS, 3)
    made = real.clone()
    made[:, 0, 0, 2] = 0.44
    made[1, 4] = 100.0
    expected = [44 / (5 * JOINTS), 44 / (3 * JOINTS)]
    assert joint_position_error(made, real, mask).tolist() == pytest.approx(expected, rel=1e-6)


def test_joint_speed_of_a_body_that_glides_is_its_speed(mask: torch.Tensor) -> None:
    joints = torch.zeros(2, 5, JOINTS, 3)
    joints[..., 0] = (torch.arange(5) * 0.05).view(1, 5, 1)
    joints[1, 3:] = 50.0
    assert joint_speed(joints, mask, fps=30.0).tolist() == pytest.approx([1.5, 1.5], rel=1e-5)
    assert math.isnan(joint_speed(joints[:1, :1], mask[:1, :1])[0])


def test_frozen_share_is_the_share_of_slow_steps() -> None:
    mask = torch.arange(12) < torch.tensor([[12], [7]])
    # Steps of 0, 1, 2, ... mm by half of the joints: a mean of 0, 0.5, 1, ... mm, at 30 Hz 0, 15, 30, ... mm/s.
    way = torch.arange(12).sub(1).clamp(min=0).cumsum(dim=0) / 1000
    joints = torch.zeros(2, 12, JOINTS, 3)
    joints[:, :, ::2, 1] = way.view(1, 12, 1)
    joints[1, 7:] = float("nan")
    slow = partial(frozen_share, joints, mask)
    assert slow(0.052).tolist() == pytest.approx([4 / 11, 4 / 6])
    assert slow(0.052, fps=60.0).tolist() == pytest.approx([2 / 11, 2 / 6])
    assert slow(0.0).tolist() == [0.0, 0.0]
    assert slow(1.0).tolist() == [1.0, 1.0]
    assert math.isnan(frozen_share(joints[:1, :1], mask[:1, :1], 1.0)[0])


def test_frozen_share_sees_the_freeze_that_a_mean_speed_hides() -> None:
    joints = torch.zeros(1, 101, JOINTS, 3)
    joints[:, :, :, 0] = torch.arange(101).clamp(max=25).view(1, 101, 1) * 0.1
    mask = torch.ones(1, 101, dtype=torch.bool)
    assert frozen_share(joints, mask, 0.05).tolist() == pytest.approx([0.75])


def test_only_feet_in_contact_skate(mask: torch.Tensor) -> None:
    resting = torch.zeros(len(FEET))
    joints = torch.ones(2, 5, JOINTS, 3)
    joints[..., 0] = (torch.arange(5) * 0.02).view(1, 5, 1)
    assert foot_skating(joints, mask, resting).isnan().all()
    joints[:, :, JOINT["left_foot"], 2] = CONTACT_MARGIN / 2
    joints[1, 3:] = 50.0
    assert foot_skating(joints, mask, resting).tolist() == pytest.approx([2.0, 2.0], rel=1e-5)
    # A foot that comes down onto the floor was not in contact before.
    joints[0, :4, JOINT["left_foot"], 2] = 1.0
    assert foot_skating(joints, mask, resting)[0].isnan()


def test_resting_heights_are_those_of_flat_feet_over_valid_frames(mask: torch.Tensor) -> None:
    joints = torch.full((2, 5, JOINTS, 3), 0.3)
    joints[0, :3, list(FEET), 2] = torch.tensor([0.11, 0.04, 0.12, 0.05])
    joints[1, 3:] = -50.0
    assert resting_heights(joints, mask).tolist() == pytest.approx([0.11, 0.04, 0.12, 0.05])
