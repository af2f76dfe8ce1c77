from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
import torch
from torch import Tensor

from motiongen.evaluation.metrics.physics import (
    bone_length_drift,
    floor_penetration,
    jerk_area,
    mean_jerk,
    peak_jerk,
)
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.skeleton import FEET, JOINT, JOINTS, PARENTS
from tests.compositions import batch, skeleton

LENGTHS = (12, 7)


@pytest.fixture
def mask() -> Tensor:
    return torch.arange(12) < torch.tensor(LENGTHS).unsqueeze(1)


@pytest.fixture
def joints() -> Tensor:
    return torch.randn(2, 12, JOINTS, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64)


@pytest.mark.parametrize(
    "metric",
    [
        partial(floor_penetration, resting=torch.zeros(len(FEET))),
        peak_jerk,
        mean_jerk,
        partial(jerk_area, reference=100.0),
        bone_length_drift,
    ],
)
def test_padding_never_enters(metric: Callable[[Tensor, Tensor], Tensor], joints: Tensor, mask: Tensor) -> None:
    found = metric(joints, mask)
    clips = [(joints[row : row + 1, :length], mask[row : row + 1, :length]) for row, length in enumerate(LENGTHS)]
    alone = torch.cat([metric(*clip) for clip in clips])
    assert found.dtype == torch.float64
    assert found.isfinite().all()
    torch.testing.assert_close(found, alone, rtol=1e-12, atol=0)
    for padding in (float("nan"), 1e6):
        spoiled = joints.masked_fill(~mask.view(2, 12, 1, 1), padding)
        assert torch.equal(metric(spoiled, mask), found)
    assert metric(joints, torch.zeros_like(mask)).isnan().all()


def test_feet_penetrate_by_their_depth_below_where_they_rest(mask: Tensor) -> None:
    resting = torch.tensor([0.10, 0.03, 0.12, 0.04])
    joints = torch.full((2, 12, JOINTS, 3), -5.0)
    joints[:, :, list(FEET), 2] = resting + 0.01
    assert floor_penetration(joints, mask, resting).tolist() == [0.0, 0.0]
    # One joint of four, 2 cm deep in 3 of 12 and in 3 of 7 frames.
    joints[:, :3, JOINT["right_ankle"], 2] = 0.10
    expected = [2.0 / 4 * 3 / 12, 2.0 / 4 * 3 / 7]
    assert floor_penetration(joints, mask, resting).tolist() == pytest.approx(expected, rel=1e-5)


def test_jerk_of_a_cubic_is_its_third_derivative_and_of_a_parabola_none(mask: Tensor) -> None:
    time = torch.arange(12, dtype=torch.float64).view(1, 12, 1, 1) / 50
    direction = torch.tensor([3.0, 4.0, 0.0]).double()
    parabola = (1 + time + 9 * time**2) * torch.ones(2, 12, JOINTS, 3).double()
    assert peak_jerk(parabola, mask, fps=50).tolist() == pytest.approx([0.0, 0.0], abs=1e-6)
    cubic = parabola.clone()
    # d^3/dt^3 of t^3 is 6; the norm of the direction is 5. The fastest joint counts.
    cubic[:, :, 7] += (time**3 * direction)[:, :, 0]
    cubic[:, :, 3] += (time**3 * direction)[:, :, 0] / 2
    for metric in (peak_jerk, mean_jerk, partial(jerk_area, reference=0.0)):
        assert metric(cubic, mask, fps=50).tolist() == pytest.approx([30.0, 30.0], rel=1e-6)
    for reference in (10.0, 50.0):
        assert jerk_area(cubic, mask, reference, fps=50).tolist() == pytest.approx([20.0, 20.0], rel=1e-6)


def test_jerk_is_that_of_numpy_s_third_difference(joints: Tensor, mask: Tensor) -> None:
    for row, length in enumerate(LENGTHS):
        curve = np.abs(np.linalg.norm(np.diff(joints[row, :length].numpy(), n=3, axis=0), axis=-1)).max(axis=-1) * 30**3
        assert float(peak_jerk(joints, mask)[row]) == pytest.approx(curve.max(), rel=1e-12)
        assert float(mean_jerk(joints, mask)[row]) == pytest.approx(curve.mean(), rel=1e-12)
        reference = float(np.median(curve))
        expected = np.abs(curve - reference).mean()
        assert float(jerk_area(joints, mask, reference)[row]) == pytest.approx(expected, rel=1e-12)


def test_a_jerk_needs_all_of_its_four_frames(joints: Tensor) -> None:
    mask = torch.ones(2, 12, dtype=torch.bool)
    mask[0, :4] = mask[1, 5] = False
    # Padding in front leaves the windows from frame 4 on; a hole at 5 leaves those that end before and begin after it.
    windows = [range(4, 9), [0, 1, 6, 7, 8]]
    for row, starts in enumerate(windows):
        clip = joints[row].numpy()
        thirds = [clip[i + 3] - 3 * clip[i + 2] + 3 * clip[i + 1] - clip[i] for i in starts]
        expected = np.mean([np.linalg.norm(third, axis=-1).max() for third in thirds]) * 30**3
        assert float(mean_jerk(joints, mask)[row]) == pytest.approx(expected, rel=1e-12)


def test_a_jump_peaks_where_a_mean_hides_it() -> None:
    still = torch.zeros(1, 300, JOINTS, 3)
    jumping = still.clone()
    jumping[:, 150:, :, 0] = 0.1
    mask = torch.ones(1, 300, dtype=torch.bool)
    # The third difference of a step of h is h, -2h, h.
    assert float(peak_jerk(jumping, mask)) == pytest.approx(2 * 0.1 * 30**3, rel=1e-6)
    assert float(mean_jerk(jumping, mask)) == pytest.approx(4 * 0.1 * 30**3 / 297, rel=1e-6)


@pytest.mark.parametrize("frames", [0, 1, 3])
def test_clips_too_short_for_a_jerk_have_none(frames: int) -> None:
    joints, mask = torch.zeros(2, frames, JOINTS, 3), torch.ones(2, frames, dtype=torch.bool)
    for metric in (peak_jerk, mean_jerk, partial(jerk_area, reference=1.0)):
        assert metric(joints, mask).isnan().all()


def test_bones_of_a_posed_skeleton_do_not_drift() -> None:
    clips = batch(LENGTHS)
    joints = joint_positions(clips.motion.double(), skeleton())
    assert bone_length_drift(joints, clips.condition.mask).tolist() == pytest.approx([0.0, 0.0], abs=1e-5)


def test_the_most_elastic_bone_drifts_by_the_standard_deviation_of_its_length(joints: Tensor, mask: Tensor) -> None:
    for row, length in enumerate(LENGTHS):
        clip = joints[row, :length].numpy()
        bones = [np.linalg.norm(clip[:, joint] - clip[:, PARENTS[joint]], axis=-1) for joint in range(1, JOINTS)]
        expected = 100 * max(np.std(bone) for bone in bones)
        assert float(bone_length_drift(joints, mask)[row]) == pytest.approx(expected, rel=1e-9)
    # A head that is now 10 and now 14 cm from the neck.
    body = torch.zeros(1, 12, JOINTS, 3)
    body[0, ::2, JOINT["head"], 2], body[0, 1::2, JOINT["head"], 2] = 0.10, 0.14
    assert float(bone_length_drift(body, mask[:1])) == pytest.approx(2.0, rel=1e-5)


def test_bones_need_the_22_joints() -> None:
    with pytest.raises(ValueError, match="22 joints, not 24"):
        bone_length_drift(torch.zeros(1, 3, 24, 3), torch.ones(1, 3, dtype=torch.bool))
