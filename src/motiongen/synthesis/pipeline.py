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
) -> LongMotion:
    """Generate action after action; each continues the last K frames of the motion so far.

    The next tag of the last action is its own tag.

    Args:
        generator: the model.
        initial_motion: (K, F) world frames before the first action.
        steps: the actions in order; at least one.
        seed: action number n is generated with seed + n.
        styles: (S,) multi-hot, of the whole motion; may be left out where the data has no styles.
    """
    styles = initial_motion.new_zeros(0) if styles is None else styles
    initial_frames = len(initial_motion)
    motion = initial_motion
    boundaries = [initial_frames]
    following = [step.tags for step in steps[1:]] + [steps[-1].tags]
    for number, (step, next_tags) in enumerate(zip(steps, following, strict=True)):
        recent = motion[-initial_frames:]
        frame = GroundFrame.of(recent[-1])
        trajectory = step.trajectory if step.trajectory is not None else motion.new_zeros(step.frames, 2)
        condition = Condition(
            tags=step.tags.unsqueeze(0),
            next_tags=next_tags.unsqueeze(0),
            initial_motion=frame.enter(recent).unsqueeze(0),
            trajectory=trajectory.unsqueeze(0),
            mask=torch.ones(1, step.frames, dtype=torch.bool, device=motion.device),
            styles=styles.unsqueeze(0),
        )
        generated = frame.leave(generator.generate(condition, seed + number)[0])
        motion = torch.cat([motion, generated])
        boundaries.append(len(motion))
    return LongMotion(motion, tuple(boundaries))
