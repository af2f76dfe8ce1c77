from __future__ import annotations

import math

import pytest
import roma
import torch

from motiongen.data.dataset import MotionDataset
from motiongen.data.sources.builtin.source import BuiltinSource
from motiongen.data.splits import Clip
from motiongen.data.store import ClipStore
from motiongen.generation.pose_forms import AxisAngle, Matrix, Quaternion
from motiongen.motion.canonical import heading
from motiongen.motion.representation import FEATURES, TRANSLATION, pack, unpack
from motiongen.motion.skeleton import JOINTS
from motiongen_plugins.hierarchical_rvae.root_velocity import RootVelocity, root_distance, wrapped
from tests.motion.poses import standing

FORMS = [Quaternion(FEATURES), AxisAngle(FEATURES), Matrix(FEATURES)]


def wandering(frames: int) -> torch.Tensor:
    """A body that turns by 2 rad/s on average, tilts in all directions and travels, (2, T, 135)."""
    generator = torch.Generator().manual_seed(0)
    yaw = (0.1 * torch.rand(2, frames, generator=generator)).cumsum(dim=1)
    tilt = 1.2 * torch.randn(2, frames, 2, generator=generator).tanh()
    joints = roma.rotvec_to_rotmat(0.5 * torch.randn(2, frames, JOINTS - 1, 3, generator=generator))
    upright = roma.euler_to_rotmat("ZYX", torch.cat([yaw.unsqueeze(-1), tilt], dim=-1))
    root = upright @ unpack(standing(1))[0][0, 0]
    position = (0.05 * torch.randn(2, frames, 3, generator=generator)).cumsum(dim=1)
    return pack(torch.cat([root.unsqueeze(2), joints], dim=2), position)


def tumbling(frames: int) -> torch.Tensor:
    """Random rotations of all joints in every frame, the pelvis' too, (2, T, 135)."""
    generator = torch.Generator().manual_seed(1)
    rotations = roma.random_rotmat((2, frames, JOINTS), generator=generator)
    return pack(rotations, torch.randn(2, frames, 3, generator=generator))


@pytest.mark.parametrize("form", FORMS, ids=lambda form: type(form).__name__)
def test_integration_is_the_inverse_of_extraction(form):
    motion = wandering(200)
    pose = RootVelocity(form)
    poses = pose.encode(motion)
    assert poses.shape == (2, 200, 6 + 21 * form.numbers)
    torch.testing.assert_close(pose.decode(poses), motion, atol=1e-5, rtol=0)
    torch.testing.assert_close(pose.decode(pose.normalize(poses)), motion, atol=1e-5, rtol=0)
    torch.testing.assert_close(pose.violation(poses), torch.zeros(2, 200), atol=1e-4, rtol=0)
    # Every yaw rate is near its largest here, so that their sum loses some places.
    fallen = tumbling(200)
    torch.testing.assert_close(pose.decode(pose.encode(fallen)), fallen, atol=2e-4, rtol=0)


def test_a_real_clip_survives_the_round_trip(tmp_path):
    store = ClipStore.open(BuiltinSource(sessions=1, subjects=1), tmp_path)
    segments = store.sequences[0].segments
    clip = Clip(0, 0, segments[0].start, segments[-1].stop, segments[0].start - 6)
    motion = MotionDataset(store, store.tags, [clip])[0].motion[:200].unsqueeze(0)
    pose = RootVelocity(FORMS[0])
    torch.testing.assert_close(pose.decode(pose.encode(motion)), motion, atol=1e-5, rtol=0)


def test_root_values_say_what_they_name():
    """A body that walks a circle to its left at 1.2 m/s and 0.5 rad/s, bent forward by 0.2 and leaning by -0.1."""
    frames = 30
    yaw = 0.5 / 30 * torch.arange(1, frames + 1)
    upright = roma.euler_to_rotmat("ZYX", torch.stack([yaw, torch.full_like(yaw, -0.1), torch.full_like(yaw, 0.2)], -1))
    motion = standing(frames).unsqueeze(0)
    rotations, _ = unpack(motion)
    rotations = rotations.clone()
    rotations[0, :, 0] = upright @ rotations[0, :, 0]
    step = 1.2 / 30 * torch.stack([yaw.sin(), -yaw.cos(), torch.zeros_like(yaw)], dim=-1)
    position = step.cumsum(dim=0) + torch.tensor([0.0, 0.0, 0.9])
    features = pack(rotations, position.unsqueeze(0))
    values = RootVelocity(FORMS[0]).encode(features)[0, :, :6]
    expected = torch.tensor([1.2, 0.0, 0.9, 0.5, 0.2, -0.1]).expand(frames, 6)
    torch.testing.assert_close(values, expected, atol=1e-4, rtol=0)
    torch.testing.assert_close(heading(features[0]), yaw, atol=1e-5, rtol=0)


def test_poses_do_not_depend_on_place_and_facing_of_the_body():
    """After the first frame, whose velocity is from the origin."""
    motion, pose = wandering(20), RootVelocity(FORMS[0])
    rotations, position = unpack(motion)
    turn = roma.rotvec_to_rotmat(torch.tensor([0.0, 0.0, 1.1]))
    moved = rotations.clone()
    moved[..., 0, :, :] = turn @ rotations[..., 0, :, :]
    shifted = position @ turn.T + torch.tensor([3.0, -2.0, 0.0])
    torch.testing.assert_close(
        pose.encode(pack(moved, shifted))[:, 1:], pose.encode(motion)[:, 1:], atol=1e-4, rtol=1e-4
    )


def test_a_motion_that_was_given_raw_numbers_is_made_of_rotations():
    torch.manual_seed(1)
    for form in FORMS:
        pose = RootVelocity(form)
        raw = torch.randn(2, 5, pose.width, requires_grad=True)
        rotations, _ = unpack(motion := pose.decode(pose.normalize(raw)))
        torch.testing.assert_close(rotations @ rotations.mT, torch.eye(3).expand_as(rotations), atol=1e-5, rtol=0)
        (motion.square().sum() + pose.violation(raw).sum()).backward()
        assert raw.grad.isfinite().all()


def test_root_distance_is_a_sum_of_absolute_differences_with_angles_wrapped():
    pose = RootVelocity(FORMS[1])
    one, other = torch.zeros(1, 1, pose.width), torch.zeros(1, 1, pose.width)
    one[0, 0, :6] = torch.tensor([1.0, -2.0, 0.5, 0.25, 3.1, 0.0])
    other[0, 0, 4] = -3.1
    assert root_distance(one, other).item() == pytest.approx(3.75 + 2 * math.pi - 6.2, rel=1e-4)
    assert wrapped(torch.tensor(2 * math.pi + 0.1)).item() == pytest.approx(0.1, abs=1e-5)


def test_height_is_the_pelvis_height():
    motion = wandering(7)
    values = RootVelocity(FORMS[0]).encode(motion)
    torch.testing.assert_close(values[..., 2], motion[..., TRANSLATION][..., 2])
