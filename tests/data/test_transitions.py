from __future__ import annotations

import numpy as np
import torch

from motiongen.data.datamodule import MotionData
from motiongen.data.splits import Clip
from motiongen.data.transitions import FADE, Transition, begin_from, draw_transition
from motiongen.motion.canonical import GroundFrame, heading
from motiongen.motion.representation import unpack
from tests.data.test_datamodule import ROWS, ListedSource
from tests.motion.poses import standing


def test_poses_come_from_anywhere_in_a_clip_and_often_from_its_end():
    rng = np.random.default_rng(0)
    drawn = [draw_transition([Clip(3, 0, 6, 40, 0), Clip(5, 1, 90, 100, 84)], rng) for _ in range(400)]
    assert {one.sequence for one in drawn} == {3, 5}
    stops = [one.stop for one in drawn if one.sequence == 3]
    assert (min(stops), max(stops)) == (7, 40)
    assert 0.4 < np.mean([stop == 40 for stop in stops]) < 0.65
    assert {one.fade for one in drawn} == set(range(FADE[0], FADE[1] + 1))


def test_a_clip_begins_from_the_other_poses_and_ends_as_itself():
    clip, other = standing(46), standing(6)
    other[:, 18:24] = torch.tensor([0.0, 1, 0, -1, 0, 0])
    other = GroundFrame(torch.tensor(2.0), torch.tensor([5.0, 1.0])).leave(other)
    got = begin_from(clip, other, Transition(0, 6, fade=10, drift=1))
    torch.testing.assert_close(got[16:], clip[16:])
    initial = got[:6]
    # In the canonical frame of the last of them, as every initial motion is.
    assert abs(float(heading(initial[-1]))) < 1e-5
    assert float(initial[-1, -3:-1].norm()) < 1e-6
    steps = got.diff(dim=0).abs().amax(dim=1)
    assert float(steps[5:].max()) < 0.35
    rotations, _ = unpack(got)
    torch.testing.assert_close(rotations @ rotations.mT, torch.eye(3).expand_as(rotations), atol=1e-5, rtol=0)


def test_drift_is_one_for_all_poses_and_follows_from_its_seed():
    other = standing(6)
    one, same, another = (begin_from(standing(40), other, Transition(0, 6, 10, drift)) for drift in (1, 1, 2))
    assert torch.equal(one, same)
    assert not torch.allclose(one[:6], another[:6])
    torch.testing.assert_close(one[:6], one[5:6].expand(6, -1))


def test_only_training_batches_have_them(tmp_path):
    def data(transitions: float) -> MotionData:
        source = ListedSource(ROWS, frozenset({"walk"}))
        return MotionData(source=source, cache=str(tmp_path), batch_size=4, transitions=transitions)

    plain, joined = data(0.0), data(1.0)
    for one, other in zip(plain.train_batches(2), joined.train_batches(2), strict=True):
        assert torch.equal(one.condition.tags, other.condition.tags)
        assert not torch.equal(one.condition.initial_motion, other.condition.initial_motion)
        # What fades is over after FADE frames.
        torch.testing.assert_close(one.motion[:, FADE[1] + 1 :], other.motion[:, FADE[1] + 1 :])
    for one, other in zip(plain.test_batches(4), joined.test_batches(4), strict=True):
        assert torch.equal(one.condition.initial_motion, other.condition.initial_motion)
    again = data(1.0)
    for one, other in zip(joined.train_batches(2), again.train_batches(2), strict=True):
        assert torch.equal(one.motion, other.motion)
    assert plain.fingerprint == joined.fingerprint
