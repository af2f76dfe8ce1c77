from __future__ import annotations

import math

import pytest
import torch

from motiongen.contracts import GeneratorModule
from motiongen.motion.canonical import GroundFrame, heading
from motiongen.motion.representation import TRANSLATION, unpack
from motiongen.synthesis.correction import Continued, Uncorrected
from motiongen.synthesis.paths import Directions, RecordedPath
from motiongen.synthesis.pipeline import TURN_A_FRAME, LongMotion, Plan, Step, equal_parts, synthesize
from tests.compositions import marionet
from tests.motion.poses import standing

GROUND = slice(TRANSLATION.start, TRANSLATION.start + 2)


class Walker(GeneratorModule):
    """Walks 10 cm a frame along its heading: in the canonical frame that is -y."""

    def generate(self, condition, seed):
        frames = condition.mask.shape[1]
        motion = condition.initial_motion[:, -1:].repeat(1, frames, 1)
        motion[..., -2] = -0.1 * torch.arange(1, frames + 1)
        return motion


class Follows(GeneratorModule):
    """Is where its trajectory says, and keeps what it was asked for."""

    def __init__(self):
        super().__init__()
        self.seen = []

    def generate(self, condition, seed):
        self.seen.append((condition, seed))
        motion = condition.initial_motion[:, -1:].repeat(1, condition.mask.shape[1], 1)
        motion[..., GROUND] = condition.trajectory
        return motion


def one(generator, start, steps, seed=0, **options) -> LongMotion:
    (motion,) = synthesize(generator, [Plan(start, steps)], seed, **options)
    return motion


def test_every_action_continues_where_the_last_one_ended():
    """A body that faces +x walks along +x, without a gap at the seams."""
    start = GroundFrame(torch.tensor(torch.pi / 2), torch.tensor([3.0, -2.0])).leave(standing(6))
    steps = [Step(torch.tensor([1.0]), 5), Step(torch.tensor([1.0]), 7)]
    motion = one(Walker(), start, steps)
    assert motion.boundaries == (6, 11, 18)
    position = motion.features[6:, -3:]
    expected = torch.stack([3 + 0.1 * torch.arange(1, 13), torch.full((12,), -2.0), position[:, 2]], dim=-1)
    torch.testing.assert_close(position, expected, atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(heading(motion.features), torch.full((18,), torch.pi / 2), atol=1e-5, rtol=1e-5)
    assert motion.smoothed == (False, False)
    assert motion.path is None


def test_the_style_is_that_of_every_action():
    generator = Follows()
    steps = [Step(torch.tensor([1.0]), 5), Step(torch.tensor([1.0]), 7)]
    synthesize(generator, [Plan(standing(6), steps, torch.tensor([0.0, 1.0]))], seed=0)
    assert [condition.styles.tolist() for condition, _ in generator.seen] == [[[0.0, 1.0]]] * 2


def test_a_long_action_is_generated_in_parts_along_one_path():
    generator = Follows()
    walk, wave = torch.eye(2)
    angles = torch.linspace(0, 1, 23)[1:]
    circle = torch.stack([1 - angles.cos(), -angles.sin()], dim=-1)
    start = GroundFrame(torch.tensor(0.7), torch.tensor([1.0, 2.0])).leave(standing(6))
    motion = one(generator, start, [Step(walk, 22, RecordedPath(circle)), Step(wave, 8)], seed=3, longest=10)
    assert motion.boundaries == (6, 28, 36)
    assert [int(condition.lengths) for condition, _ in generator.seen] == [8, 7, 7, 8]
    assert [seed for _, seed in generator.seen] == [3, 4, 5, 6]
    following = [condition.next_tags[0] for condition, _ in generator.seen]
    assert all(torch.equal(*pair) for pair in zip(following, [walk, walk, wave, wave], strict=True))
    expected = GroundFrame.of(start[-1]).leave_ground(circle)
    torch.testing.assert_close(motion.features[6:28, GROUND], expected, atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(motion.path, expected)


def test_motions_of_any_lengths_are_made_together_as_alone():
    """The code is drawn for a batch, so a generator without one is compared."""
    generator, (walk, wave) = Follows(), torch.eye(2)
    line = RecordedPath(torch.stack([torch.zeros(22), -0.1 * torch.arange(1, 23)], dim=-1))
    turned = GroundFrame(torch.tensor(1.2), torch.tensor([1.0, 2.0])).leave(standing(6))
    plans = [
        Plan(standing(6), [Step(walk, 22, line), Step(wave, 3)]),
        Plan(turned, [Step(wave, 9)]),
        Plan(turned, [Step(wave, 9), Step(walk, 12, line), Step(wave, 21)]),
    ]
    together = synthesize(generator, plans, seed=0, longest=10)
    for plan, motion in zip(plans, together, strict=True):
        (alone,) = synthesize(generator, [plan], seed=0, longest=10)
        assert alone.boundaries == motion.boundaries
        torch.testing.assert_close(alone.features, motion.features, atol=1e-6, rtol=0)
    assert max(len(condition.tags) for condition, _ in generator.seen) == 3


def test_a_body_is_turned_where_a_path_begins_in_a_direction_that_training_has_not():
    back = RecordedPath(torch.stack([torch.zeros(60), 0.02 * torch.arange(1, 61)], dim=-1))
    steps = [Step(torch.ones(1), 60, back, Directions(0.0, math.radians(30)))]
    generator = Follows()
    motion = one(generator, standing(6), steps)
    (condition, _), yaw = generator.seen[0], heading(motion.features)
    ahead = condition.trajectory[0, 5]
    assert abs(math.degrees(math.atan2(ahead[0], -ahead[1]))) == pytest.approx(30, abs=0.01)
    assert math.degrees(abs(yaw[-1])) == pytest.approx(150, abs=0.01)
    torch.testing.assert_close(motion.features[31:, GROUND], back.points[25:], atol=1e-4, rtol=0)
    turns = torch.remainder(yaw.diff() + math.pi, 2 * math.pi) - math.pi
    # Twice the mean, where the smoothing is steepest at 1.5 times.
    assert float(turns.abs().max()) < 2 * TURN_A_FRAME
    assert motion.smoothed == (True,)


def test_a_generator_without_context_is_joined_without_a_jump():
    class Elsewhere(Walker):
        """Stands turned aside, whatever came before."""

        reads = frozenset({"tags"})

        def generate(self, condition, seed):
            pose = GroundFrame(torch.tensor(1.0), torch.tensor([0.2, 0.1])).leave(standing(1))
            return pose.repeat(len(condition.tags), condition.mask.shape[1], 1)

    steps = [Step(torch.ones(1), 20), Step(torch.ones(1), 20)]
    smooth = one(Elsewhere(), standing(6), steps)
    hard = one(Elsewhere(), standing(6), steps, transition_frames=0)
    assert smooth.smoothed == (True, True)
    assert float(hard.features.diff(dim=0).abs().max()) > 0.5
    assert float(smooth.features.diff(dim=0).abs().max()) < 0.2
    torch.testing.assert_close(smooth.features[5], smooth.features[6], atol=1e-5, rtol=0)
    torch.testing.assert_close(smooth.features[16:26], hard.features[16:26])


def test_what_is_handed_on_are_rotations():
    """Displacements leave them: Gram-Schmidt brings back columns of length 1 at right angles."""

    class Stretches(Walker):
        def generate(self, condition, seed):
            return 1.3 * super().generate(condition, seed)

    motion = one(Stretches(), standing(6), [Step(torch.ones(1), 5)])
    columns = motion.features[:, :-3].unflatten(-1, (-1, 2, 3))
    torch.testing.assert_close(columns @ columns.transpose(-1, -2), torch.eye(2).expand(11, 22, 2, 2))
    assert unpack(motion.features)[1][-1, 2] == pytest.approx(1.3 * float(standing(1)[0, -1]))


def test_a_correction_that_needs_a_recognizer_says_so():
    class Asks(Uncorrected):
        asks_recognizer = True

    with pytest.raises(ValueError, match="Asks needs a recognizer"):
        one(Walker(), standing(6), [Step(torch.ones(1), 5)], correction=Asks())


def test_what_a_correction_says_jumps_is_smoothed():
    class Jumps(Uncorrected):
        def __call__(self, generator, condition, seed, recognizer):
            made = super().__call__(generator, condition, seed, recognizer)
            return Continued(made.motion, torch.tensor([seed == 1]))

    steps = [Step(torch.ones(1), 5), Step(torch.ones(1), 5), Step(torch.ones(1), 5)]
    assert one(Walker(), standing(6), steps, correction=Jumps()).smoothed == (False, True, False)


def test_where_all_seams_are_smoothed_a_body_that_walks_off_from_a_stand_gains_its_speed_by_and_by():
    steps = [Step(torch.ones(1), 20), Step(torch.ones(1), 20)]
    hard, smooth = (one(Walker(), standing(6), steps, smooth=smooth) for smooth in (False, True))
    assert (hard.smoothed, smooth.smoothed) == ((False, False), (True, True))
    gains = [motion.features[:, -2].diff().diff().abs().max() for motion in (hard, smooth)]
    torch.testing.assert_close(gains[0], torch.tensor(0.1), atol=1e-5, rtol=0)
    # A Hermite curve's slope that falls from 1 to 0 in ten frames falls by four tenths a frame at first.
    assert float(gains[1]) < 0.04
    torch.testing.assert_close(smooth.features[16:26], hard.features[16:26])
    # The second action begins at the speed that it goes on with: there is nothing to smooth.
    torch.testing.assert_close(smooth.features[26:], hard.features[26:])


def test_parts_are_few_and_equal():
    assert equal_parts(60, 60) == [60]
    assert equal_parts(61, 60) == [31, 30]
    assert equal_parts(5, 2) == [2, 2, 1]


def test_turning_the_start_turns_the_whole_motion():
    generator, tags = marionet().eval(), torch.eye(5)
    steps = [Step(tags[0], 9), Step(tags[2], 7, RecordedPath(torch.randn(7, 2)))]
    start = standing(6)
    frame = GroundFrame(torch.tensor(0.7), torch.tensor([1.0, 2.0]))
    straight = one(generator, start, steps, seed=4).features
    turned = one(generator, frame.leave(start), steps, seed=4).features
    torch.testing.assert_close(frame.leave(straight), turned, atol=1e-4, rtol=1e-4)
