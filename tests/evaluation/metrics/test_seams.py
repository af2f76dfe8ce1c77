from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from motiongen.evaluation.metrics.seams import (
    action_qualification_ratio,
    motion_qualification_ratio,
    pose_gap,
    qualified_actions,
    velocity_gap,
)


def walk(frames: int, velocity: tuple[float, float, float], start: Tensor) -> Tensor:
    """(2, frames, 5, 3): joints that move with one velocity, metres a frame; the second clip at twice that."""
    time = torch.arange(frames, dtype=torch.float64).view(1, frames, 1, 1) * torch.tensor([1.0, 2.0]).view(2, 1, 1, 1)
    return start + time * torch.tensor(velocity, dtype=torch.float64)


def test_pose_gap_is_the_joints_mean_way_across_the_seam() -> None:
    start = torch.randn(2, 1, 5, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    before = walk(4, (0.3, 0.0, 0.0), start)
    jump = torch.tensor([0.03, 0.0, 0.04], dtype=torch.float64)
    after = walk(6, (0.0, 0.7, 0.0), before[:, -1:] + jump)
    after[1, 0, 0] += jump
    # One joint of five of the second clip is twice as far.
    assert pose_gap(before, after).tolist() == pytest.approx([5.0, 6.0], rel=1e-9)
    # Only the poses at the seam matter, and neither side is the first.
    assert torch.equal(pose_gap(before[:, -1:], after[:, :1]), pose_gap(before, after))
    assert pose_gap(after.flip(1), before.flip(1)).tolist() == pytest.approx([5.0, 6.0], rel=1e-9)


def test_velocity_gap_is_the_change_of_the_joints_velocity_and_does_not_see_a_jump() -> None:
    start = torch.zeros(2, 1, 5, 3, dtype=torch.float64)
    before = walk(4, (0.03, 0.0, 0.0), start)
    after = walk(6, (0.0, 0.04, 0.0), start + 10)
    assert velocity_gap(before, after).tolist() == pytest.approx([5.0, 10.0], rel=1e-9)
    assert velocity_gap(before, walk(6, (0.03, 0.0, 0.0), start + 10)).tolist() == pytest.approx([0.0, 0.0], abs=1e-9)
    # Two frames on either side are all that is looked at.
    before[:, :-2], after[:, 2:] = 99, 99
    assert velocity_gap(before, after).tolist() == pytest.approx([5.0, 10.0], rel=1e-9)


def test_the_gaps_of_one_motion_cut_in_two_are_its_own_step_and_change_of_step() -> None:
    motion = torch.randn(3, 20, 5, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    before, after = motion[:, :8], motion[:, 8:]
    steps = motion.diff(dim=1)
    torch.testing.assert_close(pose_gap(before, after), steps[:, 7].norm(dim=-1).mean(dim=-1) * 100)
    torch.testing.assert_close(velocity_gap(before, after), (steps[:, 8] - steps[:, 6]).norm(dim=-1).mean(dim=-1) * 100)


def test_a_seam_needs_frames_of_the_same_body_on_both_sides() -> None:
    joints = torch.zeros(2, 3, 5, 3)
    with pytest.raises(ValueError, match="no seam with 1 frames"):
        pose_gap(joints[:, :0], joints)
    with pytest.raises(ValueError, match="no seam with 2 frames"):
        velocity_gap(joints, joints[:, :1])
    with pytest.raises(ValueError, match="no seam with 1 frames"):
        pose_gap(joints, joints[:, :, :4])
    with pytest.raises(ValueError, match="no seam with 2 frames"):
        velocity_gap(joints, joints[:1])


@pytest.fixture
def mask() -> Tensor:
    return torch.tensor([[True] * 5, [True] * 2 + [False] * 3, [False] + [True] * 4])


def logits_that_guess(guesses: list[list[int]]) -> Tensor:
    return torch.nn.functional.one_hot(torch.tensor(guesses), 4).double()


def test_qualification_ratios_are_those_of_the_paper_s_example(mask: Tensor) -> None:
    tags = torch.zeros(3, 5, 4)
    tags[..., 0] = 1
    # 3 accurate actions of 5; 2 of 2, whatever lies outside of the mask; 2 of 4, the first one left out.
    logits = logits_that_guess([[0, 1, 0, 2, 0], [0, 0, 1, 1, 1], [0, 0, 3, 0, 3]])
    logits[1, 2:] = float("nan")
    assert qualified_actions(logits, tags, mask).int().tolist() == [[1, 0, 1, 0, 1], [1, 1, 0, 0, 0], [0, 1, 0, 1, 0]]
    assert action_qualification_ratio(logits, tags, mask) == pytest.approx((0.6 + 1.0 + 0.5) / 3, rel=1e-12)
    assert motion_qualification_ratio(logits, tags, mask) == pytest.approx(1 / 3, rel=1e-12)


def test_a_motion_is_qualified_as_soon_as_one_of_the_tags_of_every_action_is_found(mask: Tensor) -> None:
    tags = torch.zeros(3, 5, 4)
    tags[..., 1] = tags[..., 2] = 1
    logits = logits_that_guess([[1, 2, 1, 2, 1]] * 3)
    assert action_qualification_ratio(logits, tags, mask) == motion_qualification_ratio(logits, tags, mask) == 1.0
    logits[0, 4] = torch.tensor([1.0, 0.0, 0.0, 0.0])
    assert motion_qualification_ratio(logits, tags, mask) == pytest.approx(2 / 3, rel=1e-12)


@pytest.mark.parametrize("ratio", [action_qualification_ratio, motion_qualification_ratio])
def test_motions_without_actions_are_refused(mask: Tensor, ratio: Callable[..., float]) -> None:
    mask[1] = False
    with pytest.raises(ValueError, match="at least 1 action each"):
        ratio(torch.zeros(3, 5, 4), torch.zeros(3, 5, 4), mask)
    with pytest.raises(ValueError, match="at least 1 action each"):
        ratio(torch.zeros(0, 5, 4), torch.zeros(0, 5, 4), mask[:0])
