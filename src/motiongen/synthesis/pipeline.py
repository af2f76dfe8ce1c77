"""The pure generative pipeline (Neural Marionette, section 4.3.1 and supplement, Algorithm 1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from motiongen.contracts import Condition, GeneratorModule
from motiongen.motion.canonical import GroundFrame


@dataclass(frozen=True)
class Step:
    """One action of a long motion."""

    tags: Tensor
    """(A,) multi-hot"""
    frames: int
    trajectory: Tensor | None = None
    """(T, 2): root path on the floor in the canonical frame of the pose before the action, metres; None: in place."""


@dataclass(frozen=True)
class LongMotion:
    """A motion of several actions."""

    features: Tensor
    """(K + T, F) in the world, the initial motion first."""
    boundaries: tuple[int, ...]
    """First frame of every action, then the number of frames."""


def synthesize(
    generator: GeneratorModule,
    initial_motion: Tensor,
    steps: Sequence[Step],
    seed: int,
    styles: Tensor | None = None,
    longest: int | None = None,
) -> LongMotion:
    """Generate action after action; each continues the last K frames of the motion so far.

    The next tag of the last action is its own tag.

    Args:
        generator: the model.
        initial_motion: (K, F) world frames before the first action.
        steps: the actions in order; at least one.
        seed: of the first call of the generator, seed + 1 of the second, and so on.
        styles: (S,) multi-hot, of the whole motion; may be left out where the data has no styles.
        longest: frames of the longest window that the generator was trained on. A longer action is generated in equal
            parts, as training cut it into windows: what follows a part is the action itself. None: nothing is too long.
    """
    styles = initial_motion.new_zeros(0) if styles is None else styles
    initial_frames = len(initial_motion)
    motion = initial_motion
    boundaries = [initial_frames]
    following = [step.tags for step in steps[1:]] + [steps[-1].tags]
    for step, next_tags in zip(steps, following, strict=True):
        lengths = equal_parts(step.frames, longest or step.frames)
        beginning = GroundFrame.of(motion[-1])
        for number, length in enumerate(lengths, start=1):
            recent = motion[-initial_frames:]
            frame = GroundFrame.of(recent[-1])
            path = motion.new_zeros(length, 2)
            if step.trajectory is not None:
                done = sum(lengths[: number - 1])
                path = frame.enter_ground(beginning.leave_ground(step.trajectory[done : done + length]))
            condition = Condition(
                tags=step.tags.unsqueeze(0),
                next_tags=(next_tags if number == len(lengths) else step.tags).unsqueeze(0),
                initial_motion=frame.enter(recent).unsqueeze(0),
                trajectory=path.unsqueeze(0),
                mask=torch.ones(1, length, dtype=torch.bool, device=motion.device),
                styles=styles.unsqueeze(0),
            )
            generated = frame.leave(generator.generate(condition, seed)[0])
            motion = torch.cat([motion, generated])
            seed += 1
        boundaries.append(len(motion))
    return LongMotion(motion, tuple(boundaries))


def equal_parts(frames: int, longest: int) -> list[int]:
    """The fewest parts of at most `longest` frames, their lengths differing by one at the most."""
    parts = -(-frames // longest)
    return [frames // parts + (part < frames % parts) for part in range(parts)]
