from __future__ import annotations

import torch

from motiongen.motion.kinematics import joint_positions
from motiongen.synthesis.floor import RISE, Floor
from tests.compositions import skeleton
from tests.motion.poses import standing


def floor() -> Floor:
    return Floor(skeleton(), float(joint_positions(standing(1), skeleton())[..., 2].min()))


def test_motion_that_sinks_or_floats_comes_to_the_floor():
    motion = standing(20).repeat(3, 1, 1)
    motion[1, :, -1] -= 0.3
    motion[2, :, -1] += 0.1 + torch.linspace(0.1, 0.0, 20)
    moved = floor()(motion, torch.ones(3, 20, dtype=torch.bool))
    torch.testing.assert_close(moved[0], motion[0], atol=1e-6, rtol=0)
    torch.testing.assert_close(moved[1, RISE:, -1], motion[0, RISE:, -1], atol=1e-6, rtol=0)
    # In steps that cannot be seen as a jump.
    assert float((moved[1, 1:, -1] - moved[1, :-1, -1]).max()) < 0.3 / RISE + 1e-6
    assert abs(float(moved[2, -1, -1] - motion[0, 0, -1])) < 1e-6


def test_padding_does_not_count():
    motion = standing(20).unsqueeze(0).clone()
    motion[0, 10:, -1] -= 5
    mask = (torch.arange(20) < 10).unsqueeze(0)
    torch.testing.assert_close(floor()(motion, mask), motion, atol=1e-6, rtol=0)
