from __future__ import annotations

import math

import pytest
import roma
import torch

from motiongen.motion.representation import pack, unpack
from motiongen.motion.transition import smooth_seam
from tests.motion.poses import standing


def turning(frames: int, start: float, step: float) -> torch.Tensor:
    """(1, frames, 135): a body whose elbow turns about x by `step` a frame."""
    rotations, position = unpack(standing(frames))
    angles = start + step * torch.arange(frames)
    rotations = rotations.clone()
    rotations[:, 18] = roma.rotvec_to_rotmat(torch.stack([angles, 0 * angles, 0 * angles], dim=-1))
    return pack(rotations, position).unsqueeze(0)


def elbow(motion: torch.Tensor) -> torch.Tensor:
    return roma.rotmat_to_rotvec(unpack(motion)[0][0, :, 18])[:, 0]


def hermite(time: torch.Tensor, frames: int, off: float, change: float) -> torch.Tensor:
    """A cubic from `off`, `change` a frame steep, to zero and level: through its value and slope at both ends."""
    slope = frames * change
    return off + slope * time + (-3 * off - 2 * slope) * time**2 + (2 * off + slope) * time**3


def test_the_difference_fades_by_slerp():
    before, motion = turning(6, 0.0, 0.1), turning(30, 1.5, 0.02)
    got = elbow(smooth_seam(before, motion, torch.tensor([10])))
    # The poses before lead to 0.6 and 0.7; the motion has 1.5 and 1.52.
    assert got[0] == pytest.approx(0.6, abs=1e-5)
    fading = hermite(torch.arange(10) / 10, 10, off=-0.9, change=0.08)
    torch.testing.assert_close(got[:10], elbow(motion)[:10] + fading, atol=1e-5, rtol=0)
    torch.testing.assert_close(got[10:], elbow(motion)[10:])


def test_neither_pose_nor_velocity_jumps():
    before, motion = turning(6, 0.0, 0.1), turning(90, 1.5, -0.05)
    before, motion = before.clone(), motion.clone()
    before[..., -2] += 0.04 * torch.arange(6)
    motion[..., -2] -= 0.02 * torch.arange(90)
    whole = torch.cat([before, smooth_seam(before, motion, torch.tensor([60]))], dim=1)
    for values in (elbow(whole), whole[0, :, -2]):
        jump = values[5:7].diff() - values[4:6].diff()
        assert float(jump.abs()) < 1e-5
        # Without the change of the difference, the velocity would jump by 0.15 and 0.06 in the frame after.
        assert float(values.diff().diff().abs().max()) < 0.02


def test_positions_fade_too():
    before, motion = standing(6).unsqueeze(0), standing(20).unsqueeze(0).clone()
    motion[..., -3] += 1.0
    got = smooth_seam(before, motion, torch.tensor([8]))[0, :, -3]
    assert got[0] == pytest.approx(0.0, abs=1e-6)
    assert bool((got.diff() >= -1e-6).all())
    assert got[8] == 1.0


def test_every_motion_has_frames_of_its_own_and_none_changes_nothing():
    before = turning(6, 0.0, 0.0).repeat(3, 1, 1)
    motion = turning(12, 1.0, 0.0).repeat(3, 1, 1)
    got = smooth_seam(before, motion, torch.tensor([0, 4, 99]))
    assert torch.equal(got[0], motion[0])
    assert torch.equal(got[1, 4:], motion[1, 4:])
    assert float(elbow(got[2:])[-1]) < 0.2
    assert smooth_seam(before, motion, torch.zeros(3, dtype=torch.long)) is motion


def test_a_motion_of_one_frame_is_joined():
    before, motion = turning(6, 0.0, 0.1), turning(1, 1.5, 0.0)
    assert elbow(smooth_seam(before, motion, torch.tensor([10])))[0] == pytest.approx(0.6, abs=1e-5)


def test_the_short_way_is_taken():
    before, motion = turning(6, math.radians(170), 0.0), turning(20, math.radians(-170), 0.0)
    got = smooth_seam(before, motion, torch.tensor([10]))
    assert float(torch.cos(elbow(got)).max()) < math.cos(math.radians(169))
