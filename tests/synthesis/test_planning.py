from __future__ import annotations

import logging
import math
from pathlib import Path

import numpy as np
import pytest
import torch

from motiongen.data.clips import Segment, Sequence
from motiongen.data.datamodule import MotionData
from motiongen.motion.canonical import GroundFrame, heading
from motiongen.motion.representation import TRANSLATION
from motiongen.synthesis.limits import limits_of
from motiongen.synthesis.paths import DrawnPath, PlacedPath, RecordedPath
from motiongen.synthesis.planning import Planner
from motiongen.synthesis.timeline import Action, Start, Timeline, TimelineError
from tests.data.corpus import ListedSource
from tests.motion.poses import standing

GROUND = slice(TRANSLATION.start, TRANSLATION.start + 2)
SPEED = 1.2
"""Metres per second of every walk"""
AHEAD = ((0.0, 0.0), (0.0, -1.0), (0.0, -2.0))


def walk(number: int) -> Sequence:
    """Straight ahead at SPEED, 66 frames, from somewhere in some direction."""
    motion = standing(66)
    motion[:, -2] = -SPEED / 30 * torch.arange(66)
    frame = GroundFrame(torch.tensor(0.9 * number), torch.tensor([1.0 * number, 2.0]))
    style = "sad" if number % 2 else "happy"
    return Sequence(f"walk_{number}", f"walk_{number}", frame.leave(motion), (Segment(0, 66, ("walk",), (style,)),))


def wave(number: int) -> Sequence:
    return Sequence(f"wave_{number}", f"wave_{number}", standing(56), (Segment(0, 56, ("wave",), ("happy",)),))


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> MotionData:
    source = ListedSource([make(number) for number in range(8) for make in (walk, wave)], frozenset({"walk"}))
    return MotionData(source=source, cache=str(tmp_path_factory.mktemp("cache")), max_frames=60)


def timeline(*actions: Action, **options) -> Timeline:
    return Timeline(tuple(actions), **options)


WALK, WAVE = Action(("walk",), 2.0), Action(("wave",), 1.5)


def test_limits_are_those_of_the_training_clips(data):
    limits = limits_of("walk", data)
    assert limits.shortest == limits.longest == 2.0
    assert limits.usual_speed == pytest.approx(SPEED, rel=1e-4)
    assert limits.top_speed == pytest.approx(SPEED, rel=1e-4)
    assert limits.directions.middle == pytest.approx(0.0, abs=1e-5)
    assert limits.directions.spread == pytest.approx(0.0, abs=1e-5)
    assert limits_of("wave", data).top_speed == 0


def test_what_the_timeline_leaves_open_comes_from_training_clips(data):
    plan = Planner(timeline(WALK, WAVE), data).plan(0)
    step, other = plan.steps
    assert [data.tags[int(one.tags.argmax())] for one in plan.steps] == ["walk", "wave"]
    assert (step.frames, other.frames, other.path) == (60, 45, None)
    assert isinstance(step.path, RecordedPath)
    torch.testing.assert_close(step.path.points[-1], torch.tensor([0.0, -SPEED * 2]), atol=1e-4, rtol=0)
    torch.testing.assert_close(plan.initial_motion[-1, GROUND], torch.zeros(2))
    assert plan.styles.sum() == 1
    again = Planner(timeline(WALK, WAVE), data).plan(0)
    assert torch.equal(plan.initial_motion, again.initial_motion)


def test_a_style_is_taken_from_clips_of_that_style(data):
    for seed in range(6):
        plan = Planner(timeline(WALK, style="sad"), data).plan(seed)
        assert plan.styles.tolist() == [float(style == "sad") for style in data.styles]


def test_a_path_of_an_action_begins_where_the_body_is(data):
    east = ((5.0, 5.0), (6.0, 5.0), (7.0, 5.0))
    plan = Planner(timeline(Action(("walk",), 2.0, east), WAVE, Action(("walk",), 2.0, AHEAD)), data).plan(0)
    first, _, last = plan.steps
    assert isinstance(first.path, DrawnPath)
    torch.testing.assert_close(first.path.points[-1], torch.tensor([2.0, 0.0]))
    torch.testing.assert_close(last.path.points[-1], torch.tensor([0.0, -2.0]))
    # The body stands at its first point and looks along it.
    torch.testing.assert_close(plan.initial_motion[-1, GROUND], torch.tensor([5.0, 5.0]))
    assert float(heading(plan.initial_motion[-1])) == pytest.approx(math.pi / 2, abs=1e-4)
    assert last.directions.outside(1.0) == pytest.approx(1.0, abs=1e-4)


def test_one_path_is_shared_by_all_actions_that_travel(data):
    line = ((1.0, 0.0), (1.0, -2.0), (1.0, -4.0))
    short, long = Action(("walk",), 1.0), Action(("walk",), 3.0)
    plan = Planner(timeline(short, WAVE, long, path=line), data).plan(0)
    first, wave, last = (step.path for step in plan.steps)
    assert isinstance(first, PlacedPath)
    assert wave is None
    torch.testing.assert_close(first.start + first.points[-1], last.start)
    torch.testing.assert_close(last.start, torch.tensor([1.0, -1.0]), atol=1e-3, rtol=0)
    torch.testing.assert_close(last.start + last.points[-1], torch.tensor([1.0, -4.0]), atol=1e-4, rtol=0)
    torch.testing.assert_close(plan.initial_motion[-1, GROUND], torch.tensor([1.0, 0.0]))


def test_a_motion_may_start_from_a_clip_or_a_file(data, tmp_path):
    given = Planner(timeline(WAVE, start=Start(clip="walk_3", frame=20)), data).plan(0).initial_motion
    clip = data.store.features([one.name for one in data.store.sequences].index("walk_3"))
    torch.testing.assert_close(given, GroundFrame.of(clip[20]).enter(clip[15:21]))
    np.savez(tmp_path / "pose.npz", features=standing(1).numpy())
    plan = Planner(timeline(WAVE, start=Start(file=tmp_path / "pose.npz")), data).plan(0)
    torch.testing.assert_close(plan.initial_motion, standing(6), atol=1e-6, rtol=0)
    assert plan.styles.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (timeline(Action(("wave",), 1.5, AHEAD)), r"actions\[0\].path: wave does not travel\n  tags that do: walk"),
        (timeline(WAVE, path=AHEAD), "path: none of the actions travels"),
        (
            timeline(WAVE, Action(("walk",), 1.0, AHEAD)),
            r"actions\[1\].path: 2.0 m in 1 s are 2.0 m/s, too fast for actions\[1\] \(walk\), which reaches 1.2 m/s",
        ),
        (timeline(Action(("walk",), 1.0), path=AHEAD), r"timeline: path: 2.0 m in 1 s .* too fast for actions\[0\]"),
        (timeline(WAVE, style="hapy"), "style: unknown style 'hapy'; did you mean 'happy'"),
        (timeline(WAVE, start=Start(clip="walk_9")), "start.clip: unknown clip 'walk_9'; did you mean 'walk_"),
        (timeline(WAVE, start=Start(clip="walk_1", frame=66)), "start.frame: 66 is not among the frames 5 to 65"),
        (timeline(WAVE, start=Start(clip="walk_1", frame=4)), "start.frame: 4 is not among the frames 5 to 65"),
    ],
)
def test_what_cannot_be_is_told(data, made, message):
    with pytest.raises(TimelineError, match=message):
        Planner(made, data)


def test_a_file_that_is_no_motion_is_told(data, tmp_path: Path):
    (tmp_path / "pose.npz").write_bytes(b"no")
    with pytest.raises(ValueError, match=r"pose\.npz: not an NPZ file"):
        Planner(timeline(WAVE, start=Start(file=tmp_path / "pose.npz")), data)


def test_an_unusual_duration_is_a_warning(data, caplog):
    with caplog.at_level(logging.WARNING):
        Planner(timeline(WALK, Action(("walk",), 9.0), Action(("wave",), 0.5)), data)
    assert [record.getMessage() for record in caplog.records] == [
        "timeline: actions[1] (walk): 9 s; training clips take 2.0 to 2.0 s",
        "timeline: actions[2] (wave): 0.5 s; training clips take 1.7 to 1.7 s",
    ]
