from __future__ import annotations

import torch

from motiongen.contracts import GeneratorModule
from motiongen.motion.canonical import GroundFrame, heading
from motiongen.synthesis.paths import fit_path
from motiongen.synthesis.pipeline import Step, equal_parts, synthesize
from tests.compositions import marionet
from tests.motion.poses import standing


class Walker(GeneratorModule):
    """Walks 10 cm a frame along its heading: in the canonical frame that is -y."""

    def generate(self, condition, seed):
        frames = condition.mask.shape[1]
        motion = condition.initial_motion[:, -1:].repeat(1, frames, 1)
        motion[..., -2] = -0.1 * torch.arange(1, frames + 1)
        return motion


def test_every_action_continues_where_the_last_one_ended():
    """A body that faces +x walks along +x, without a gap at the seams."""
    start = GroundFrame(torch.tensor(torch.pi / 2), torch.tensor([3.0, -2.0])).leave(standing(6))
    steps = [Step(torch.tensor([1.0]), 5), Step(torch.tensor([1.0]), 7)]
    motion = synthesize(Walker(), start, steps, seed=0)
    assert motion.boundaries == (6, 11, 18)
    position = motion.features[6:, -3:]
    expected = torch.stack([3 + 0.1 * torch.arange(1, 13), torch.full((12,), -2.0), position[:, 2]], dim=-1)
    torch.testing.assert_close(position, expected, atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(heading(motion.features), torch.full((18,), torch.pi / 2), atol=1e-5, rtol=1e-5)


def test_the_style_is_that_of_every_action():
    seen = []

    class Keeps(Walker):
        def generate(self, condition, seed):
            seen.append(condition.styles.tolist())
            return super().generate(condition, seed)

    steps = [Step(torch.tensor([1.0]), 5), Step(torch.tensor([1.0]), 7)]
    synthesize(Keeps(), standing(6), steps, seed=0, styles=torch.tensor([0.0, 1.0]))
    assert seen == [[[0.0, 1.0]]] * 2


def test_a_long_action_is_generated_in_parts_along_one_path():
    seen = []

    class Follows(Walker):
        def generate(self, condition, seed):
            seen.append((condition, seed))
            motion = condition.initial_motion[:, -1:].repeat(1, condition.mask.shape[1], 1)
            motion[..., -3:-1] = condition.trajectory
            return motion

    walk, wave = torch.eye(2)
    angles = torch.linspace(0, 1, 23)[1:]
    circle = torch.stack([1 - angles.cos(), -angles.sin()], dim=-1)
    start = GroundFrame(torch.tensor(0.7), torch.tensor([1.0, 2.0])).leave(standing(6))
    motion = synthesize(Follows(), start, [Step(walk, 22, circle), Step(wave, 8)], seed=3, longest=10)
    assert motion.boundaries == (6, 28, 36)
    assert [int(condition.lengths) for condition, _ in seen] == [8, 7, 7, 8]
    assert [seed for _, seed in seen] == [3, 4, 5, 6]
    following = [condition.next_tags[0] for condition, _ in seen]
    assert all(torch.equal(*pair) for pair in zip(following, [walk, walk, wave, wave], strict=True))
    expected = GroundFrame.of(start[-1]).leave_ground(circle)
    torch.testing.assert_close(motion.features[6:28, -3:-1], expected, atol=1e-5, rtol=1e-5)


def test_parts_are_few_and_equal():
    assert equal_parts(60, 60) == [60]
    assert equal_parts(61, 60) == [31, 30]
    assert equal_parts(5, 2) == [2, 2, 1]


def test_turning_the_start_turns_the_whole_motion():
    generator, tags = marionet().eval(), torch.eye(5)
    steps = [Step(tags[0], 9), Step(tags[2], 7, trajectory=torch.randn(7, 2))]
    start = standing(6)
    frame = GroundFrame(torch.tensor(0.7), torch.tensor([1.0, 2.0]))
    straight = synthesize(generator, start, steps, seed=4).features
    turned = synthesize(generator, frame.leave(start), steps, seed=4).features
    torch.testing.assert_close(frame.leave(straight), turned, atol=1e-4, rtol=1e-4)


def test_short_paths_go_on_and_long_ones_are_cut():
    path = torch.stack([torch.arange(20.0), torch.zeros(20)], dim=-1)
    assert torch.equal(fit_path(path, 5), path[:5])
    torch.testing.assert_close(fit_path(path, 23)[:, 0], torch.arange(23.0))
