"""The generative pipeline (Neural Marionette, section 4.3, and supplement, Algorithm 1), many long motions at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor
from torch.nn.utils.rnn import pad_sequence

from motiongen.contracts import Condition, GeneratorModule
from motiongen.motion.canonical import GroundFrame
from motiongen.motion.certainty import settle
from motiongen.motion.transition import smooth_seam
from motiongen.recognition.recognizer import Recognizer
from motiongen.synthesis.correction import Correction, Uncorrected
from motiongen.synthesis.paths import Directions, RootPath, direction

TRANSITION_FRAMES = 10
"""A third of a second."""
TURN_A_FRAME = math.pi / 30
"""Radians: the fastest that a body is turned where a path does not begin in a direction of training; 180 degrees a
second."""


@dataclass(frozen=True)
class Step:
    """One action of a long motion."""

    tags: Tensor
    """(A,) multi-hot"""
    frames: int
    path: RootPath | None = None
    """Where the root goes; None: in place."""
    directions: Directions | None = None
    """Where a path may begin; the body is turned where it begins elsewhere. None: anywhere."""


@dataclass(frozen=True)
class Plan:
    """What one long motion is made from."""

    initial_motion: Tensor
    """(K, F) world frames before the first action"""
    steps: Sequence[Step]
    """The actions in order; at least one"""
    styles: Tensor = field(default_factory=lambda: torch.zeros(0))
    """(S,) multi-hot, of the whole motion; may be left out where the data has no styles"""


@dataclass(frozen=True)
class LongMotion:
    """A motion of several actions."""

    features: Tensor
    """(K + T, F) in the world, the initial motion first."""
    boundaries: tuple[int, ...]
    """First frame of every action, then the number of frames."""
    smoothed: tuple[bool, ...]
    """Of every action, whether its seam, or one between its parts, was smoothed."""
    path: Tensor | None
    """(N, 2): where the actions that travel were to go, in the world; None if there are none."""


@dataclass(frozen=True)
class _Call:
    """What one call of the generator makes: an action, or a part of one that is longer than a training window."""

    action: int
    tags: Tensor
    next_tags: Tensor
    first: int
    """Frames of the action that are done before it"""
    length: int


def synthesize(
    generator: GeneratorModule,
    plans: Sequence[Plan],
    seed: int,
    *,
    correction: Correction | None = None,
    recognizer: Recognizer | None = None,
    longest: int | None = None,
    transition_frames: int = TRANSITION_FRAMES,
    smooth: bool = False,
    floor: Callable[[Tensor, Tensor], Tensor] | None = None,
) -> list[LongMotion]:
    """Generate action after action; each continues the last K frames of the motion so far.

    The next tag of the last action is its own tag. The n-th actions of all plans are generated together, so that a
    hundred motions take little longer than one.

    Args:
        generator: the model.
        plans: one for every motion.
        seed: of the first call of the generator, seed + 1 of the second, and so on.
        correction: what acts against drift; the pure pipeline by default.
        recognizer: for corrections that ask one; the generator's device.
        longest: frames of the longest window that the generator was trained on. A longer action is generated in equal
            parts, as training cut it into windows: what follows a part is the action itself. None: nothing is too long.
        transition_frames: how many frames a seam is smoothed over where an action may not begin with the pose before.
        smooth: whether all seams are smoothed so, as a generator that continues a pose need not continue its velocity.
        floor: puts motions (B, T, F), of which the frames in mask (B, T) count, on the floor (`floor.Floor`).

    Raises:
        ValueError: the correction asks for a recognizer, and there is none.
    """
    correction = correction or Uncorrected()
    if correction.asks_recognizer and recognizer is None:
        raise ValueError(f"{type(correction).__name__} needs a recognizer")
    device = next((parameter.device for parameter in generator.parameters()), torch.device("cpu"))
    tracks = [_Track(plan, longest, device) for plan in plans]
    for turn in range(max(len(track.calls) for track in tracks)):
        active = [track for track in tracks if turn < len(track.calls)]
        condition, frame = _conditions(active, turn)
        made = correction(generator, condition, seed + turn, recognizer)
        turns = torch.tensor([abs(track.turned) for track in active], device=device)
        smoothed = (turns / TURN_A_FRAME).ceil().long().maximum(transition_frames * (made.jumps | smooth))
        recent = torch.stack([track.recent for track in active])
        motion = smooth_seam(recent, settle(recent, frame.leave(made.motion), condition.mask), smoothed)
        if floor is not None:
            motion = floor(motion, condition.mask)
        for track, own, frames in zip(active, motion, smoothed.tolist(), strict=True):
            track.extend(own, turn, frames > 0)
    return [track.result() for track in tracks]


class _Track:
    """One long motion on its way."""

    def __init__(self, plan: Plan, longest: int | None, device: torch.device) -> None:
        self.plan = plan
        self.calls = list(_calls(plan.steps, longest))
        self.recent = plan.initial_motion.to(device)
        self.turned = 0.0
        self._parts = [self.recent]
        self._path = self.recent.new_zeros(0, 2)
        self._paths: list[Tensor] = []
        self._smoothed = [False] * len(plan.steps)

    def begin(self, turn: int) -> tuple[GroundFrame, Tensor]:
        """The frame in which the call's motion is generated, and its path (T, 2) there."""
        call = self.calls[turn]
        step = self.plan.steps[call.action]
        here = GroundFrame.of(self.recent[-1])
        self.turned = 0.0
        if step.path is None:
            return here, self.recent.new_zeros(call.length, 2)
        if call.first == 0:
            self._path = step.path.place(here)
            self._paths.append(self._path)
        path = self._path[call.first : call.first + call.length]
        ahead = here.enter_ground(path)
        if step.directions is not None:
            self.turned = step.directions.outside(direction(ahead))
            here = GroundFrame(here.yaw + self.turned, here.origin)
            ahead = here.enter_ground(path)
        return here, ahead

    def extend(self, motion: Tensor, turn: int, smoothed: bool) -> None:
        """Take the frames of the call from motion (T, F), whose rest is padding."""
        call = self.calls[turn]
        self._parts.append(motion[: call.length])
        self.recent = torch.cat([self.recent, self._parts[-1]])[-len(self.recent) :]
        self._smoothed[call.action] |= smoothed

    def result(self) -> LongMotion:
        boundaries = [len(self.plan.initial_motion)]
        for step in self.plan.steps:
            boundaries.append(boundaries[-1] + step.frames)
        return LongMotion(
            features=torch.cat(self._parts).cpu(),
            boundaries=tuple(boundaries),
            smoothed=tuple(self._smoothed),
            path=torch.cat(self._paths).cpu() if self._paths else None,
        )


def _calls(steps: Sequence[Step], longest: int | None) -> Iterator[_Call]:
    following = [step.tags for step in steps[1:]] + [steps[-1].tags]
    for action, (step, next_tags) in enumerate(zip(steps, following, strict=True)):
        done = 0
        for length in equal_parts(step.frames, longest or step.frames):
            ends = done + length == step.frames
            yield _Call(action, step.tags, next_tags if ends else step.tags, done, length)
            done += length


def _conditions(active: Sequence[_Track], turn: int) -> tuple[Condition, GroundFrame]:
    """What the generator is asked for, and the frames in the world that its motions are in."""
    calls = [track.calls[turn] for track in active]
    frames, paths = zip(*(track.begin(turn) for track in active), strict=True)
    recent = torch.stack([track.recent for track in active])
    lengths = torch.tensor([call.length for call in calls], device=recent.device)
    condition = Condition(
        tags=torch.stack([call.tags for call in calls]),
        next_tags=torch.stack([call.next_tags for call in calls]),
        initial_motion=GroundFrame.of(recent[:, -1]).enter(recent),
        trajectory=pad_sequence(list(paths), batch_first=True),
        mask=torch.arange(int(lengths.max()), device=recent.device) < lengths[:, None],
        styles=torch.stack([track.plan.styles for track in active]),
    ).to(recent.device)
    frame = GroundFrame(
        torch.stack([one.yaw for one in frames]),
        torch.stack([one.origin for one in frames]),
    )
    return condition, frame


def equal_parts(frames: int, longest: int) -> list[int]:
    """The fewest parts of at most `longest` frames, their lengths differing by one at the most."""
    parts = -(-frames // longest)
    return [frames // parts + (part < frames % parts) for part in range(parts)]


def canonical_parts(before: Tensor, motion: Tensor, longest: int) -> Iterator[Tensor]:
    """An action (T, 135) in the parts in which it is made, each in the canonical frame of the pose before it.

    Args:
        before: (135,) the pose before the action.
        motion: the action, in the same frame of reference.
        longest: frames of the longest part.
    """
    for length in equal_parts(len(motion), longest):
        part, motion = motion[:length], motion[length:]
        yield GroundFrame.of(before).enter(part)
        before = part[-1]
