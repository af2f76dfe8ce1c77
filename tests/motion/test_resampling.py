from __future__ import annotations

import math

import pytest
import roma
import torch

from motiongen.motion.resampling import resample


def spin(frames: int, fps: float, radians_per_second: float) -> tuple[torch.Tensor, torch.Tensor]:
    """A body that turns about z at a constant rate and moves along x at 1 m/s."""
    time = torch.arange(frames, dtype=torch.float64) / fps
    axis = torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
    rotations = roma.rotvec_to_rotmat(time[:, None, None] * radians_per_second * axis)
    return rotations, torch.stack([time, torch.zeros_like(time), torch.zeros_like(time)], dim=-1)


@pytest.mark.parametrize("source", [120.0, 120.00004577, 100.0, 59.0, 250.0, 25.0, 30.0])
def test_constant_motion_keeps_its_pace(source):
    rotations, position = resample(*spin(int(source * 2) + 1, source, 3.0), source, 30.0)
    expected, path = spin(len(rotations), 30.0, 3.0)
    assert len(rotations) in (60, 61)
    torch.testing.assert_close(rotations, expected, atol=1e-6, rtol=0)
    torch.testing.assert_close(position, path, atol=1e-9, rtol=0)


def test_goes_the_short_way_across_half_a_turn():
    rotations, position = spin(2, 1.0, math.radians(200))
    middle = resample(rotations, position, 1.0, 2.0)[0][1]
    angle = roma.rotmat_to_rotvec(middle).norm().item()
    assert math.degrees(angle) == pytest.approx(80, abs=1e-4)


def test_single_frame_stays():
    rotations, position = spin(1, 30.0, 1.0)
    assert len(resample(rotations, position, 120.0, 30.0)[0]) == 1


@pytest.mark.parametrize(("source", "target"), [(0.0, 30.0), (30.0, -1.0)])
def test_rates_must_be_positive(source, target):
    with pytest.raises(ValueError, match="positive"):
        resample(*spin(3, 30.0, 1.0), source, target)


def test_no_frames():
    with pytest.raises(ValueError, match="no frames"):
        resample(torch.zeros(0, 22, 3, 3), torch.zeros(0, 3), 30.0, 30.0)
