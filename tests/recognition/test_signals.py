from __future__ import annotations

import pytest
import torch
from torch import Tensor

from motiongen.motion.canonical import GroundFrame
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import FEATURES
from motiongen.motion.skeleton import JOINTS, Skeleton
from motiongen.recognition.signals import SIGNALS, body_signals, joint_signals


@pytest.fixture
def skeleton() -> Skeleton:
    offsets = torch.randn(JOINTS, 3, generator=torch.Generator().manual_seed(1)) * 0.2
    offsets[0] = 0
    return Skeleton(offsets)


@pytest.fixture
def motion() -> Tensor:
    return torch.randn(3, 12, FEATURES, generator=torch.Generator().manual_seed(2))


def test_signals_do_not_depend_on_where_the_body_stands(skeleton: Skeleton, motion: Tensor) -> None:
    mask = torch.ones(3, 12, dtype=torch.bool)
    moved = GroundFrame(torch.zeros(3), torch.tensor([[5.0, -3.0]]).expand(3, 2)).leave(motion)
    signals = body_signals(motion, mask, skeleton)
    assert signals.shape == (3, 12, SIGNALS)
    torch.testing.assert_close(body_signals(moved, mask, skeleton), signals, atol=1e-3, rtol=0)


def test_joints_are_seen_from_the_pelvis_and_the_pelvis_from_the_floor(skeleton: Skeleton, motion: Tensor) -> None:
    mask = torch.arange(12) < torch.tensor([[12], [7], [1]])
    signals, joints = joint_signals(motion, mask, skeleton, fps=10.0), joint_positions(motion, skeleton)
    for clip, length in enumerate((12, 7, 1)):
        for frame in range(12):
            for joint in range(JOINTS):
                place, velocity = signals[clip, frame, joint].split(3)
                if frame >= length:
                    assert not place.any()
                    assert not velocity.any()
                    continue
                pelvis = joints[clip, frame, 0]
                expected = torch.stack([0 * pelvis[2], 0 * pelvis[2], pelvis[2]])
                torch.testing.assert_close(place, joints[clip, frame, joint] - pelvis if joint else expected)
                past = joints[clip, max(frame - 1, 0), joint]
                torch.testing.assert_close(velocity, (joints[clip, frame, joint] - past) * 10.0)


def test_a_frame_is_all_joints_but_the_pelvis_place_on_the_floor(skeleton: Skeleton, motion: Tensor) -> None:
    mask = torch.arange(12) < torch.tensor([[12], [7], [1]])
    joints, frames = joint_signals(motion, mask, skeleton), body_signals(motion, mask, skeleton)
    assert torch.equal(frames[..., :63].unflatten(-1, (21, 3)), joints[..., 1:, :3])
    assert torch.equal(frames[..., 63], joints[..., 0, 2])
    assert torch.equal(frames[..., 64:].unflatten(-1, (22, 3)), joints[..., 3:])
