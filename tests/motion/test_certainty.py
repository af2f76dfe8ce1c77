from __future__ import annotations

import math

import pytest
import roma
import torch

from motiongen.motion.certainty import SURE, settle
from motiongen.motion.representation import pack, unpack
from tests.motion.poses import standing


def yawed(angles: torch.Tensor) -> torch.Tensor:
    """(T,) radians to features (1, T, 135): a standing body that turns about the vertical."""
    rotations, position = unpack(standing(len(angles)))
    turns = roma.rotvec_to_rotmat(torch.stack([0 * angles, 0 * angles, angles], dim=-1))
    rotations = rotations.clone()
    rotations[:, 0] = turns @ rotations[:, 0]
    return pack(rotations, position).unsqueeze(0)


def yaw(motion: torch.Tensor) -> torch.Tensor:
    """(B, T, 135) to how far the body has turned from standing, radians (B, T)."""
    rotations, _ = unpack(motion)
    turned = rotations[..., 0, :, :] @ unpack(standing(1))[0][0, 0].T
    return torch.atan2(turned[..., 1, 0], turned[..., 0, 0])


def steps(motion: torch.Tensor) -> torch.Tensor:
    """(B, T, 135) to the turn from frame to frame, radians from -pi to pi (B, T - 1)."""
    return torch.remainder(yaw(motion).diff() + math.pi, 2 * math.pi) - math.pi


@pytest.fixture
def undecided() -> torch.Tensor:
    """(1, 40, 135): the mean of a turn to the left by 171 degrees and a slightly smaller one to the right."""
    angles = torch.linspace(0, 0.95 * math.pi, 40)
    return 0.52 * yawed(angles) + 0.48 * yawed(-0.9 * angles)


def everything(motion: torch.Tensor) -> torch.Tensor:
    return torch.ones(motion.shape[:2], dtype=torch.bool)


def test_the_mean_of_a_turn_to_either_side_becomes_a_turn(undecided):
    before = standing(6).unsqueeze(0)
    flipped = pack(*unpack(undecided))
    settled = settle(before, undecided, everything(undecided))
    # Gram-Schmidt alone turns by 84 degrees from one frame to the next.
    assert float(steps(flipped).abs().max()) > math.radians(80)
    # Half a circle in the 14 frames that are not sure, 1.5 times as fast in the middle.
    assert float(steps(settled).abs().max()) < math.radians(20)
    torch.testing.assert_close(yaw(settled)[0, -1], yaw(flipped)[0, -1])
    # The body stays upright on the way.
    up = unpack(settled)[0][0, :, 0] @ unpack(standing(1))[0][0, 0].T
    torch.testing.assert_close(up[:, 2, 2], torch.ones(40), atol=1e-4, rtol=0)


def test_sure_frames_are_only_brought_back_to_rotations(undecided):
    columns = undecided[..., :6].unflatten(-1, (2, 3)).norm(dim=-1).amin(dim=-1)[0]
    sure = columns > SURE + 0.01
    assert 10 < int(sure.sum()) < 35
    settled = settle(standing(6).unsqueeze(0), undecided, everything(undecided))
    torch.testing.assert_close(settled[:, sure], pack(*unpack(undecided))[:, sure])
    lengths = settled[..., :-3].unflatten(-1, (-1, 3)).norm(dim=-1)
    torch.testing.assert_close(lengths, torch.ones_like(lengths))


def test_the_way_begins_at_the_pose_before_and_ends_at_the_last_frame():
    before = yawed(torch.full((6,), 0.3))
    motion = 0.2 * yawed(torch.full((9,), 1.3))
    got = yaw(settle(before, motion, everything(motion)))[0]
    share = torch.arange(1, 10) / 9
    torch.testing.assert_close(got, 0.3 + share**2 * (3 - 2 * share), atol=1e-5, rtol=0)


def test_other_motions_of_the_batch_and_padding_change_nothing(undecided):
    before = standing(6).unsqueeze(0)
    alone = settle(before, undecided[:, :33], everything(undecided[:, :33]))
    batch = torch.cat([undecided, yawed(torch.zeros(40)), undecided])
    batch[0, 33:] = 0.01
    mask = torch.ones(3, 40, dtype=torch.bool)
    mask[0, 33:] = False
    together = settle(before.expand(3, -1, -1), batch, mask)
    torch.testing.assert_close(together[0, :33], alone[0])
    torch.testing.assert_close(together[1], batch[1])


def test_a_joint_is_taken_by_itself():
    motion = standing(10).unsqueeze(0).clone()
    motion[:, 4:7, 60:66] *= 0.1
    torch.testing.assert_close(
        settle(standing(6).unsqueeze(0), motion, everything(motion)), standing(10).unsqueeze(0), atol=1e-6, rtol=0
    )
