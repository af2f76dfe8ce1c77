"""Continuous sessions: who performs what in which order, and the features that come of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch

from motiongen.data.clips import Segment, Sequence
from motiongen.data.sources.builtin.actions.footwork import step, turn
from motiongen.data.sources.builtin.actions.gestures import kick, punch, throw, wave_hand
from motiongen.data.sources.builtin.actions.locomotion import gait
from motiongen.data.sources.builtin.actions.posture import jump, sit, sit_down, stand, stand_up
from motiongen.data.sources.builtin.actor import Actor
from motiongen.data.sources.builtin.curves import Array, slow_noise
from motiongen.data.sources.builtin.ik import solve
from motiongen.data.sources.builtin.score import FPS, SIDES, TRUNK
from motiongen.data.sources.builtin.subjects import Subject
from motiongen.motion.representation import pack

LEAD = 0.5
"""Seconds of rest before the first action, so that it has a predecessor."""
ACTIONS: dict[str, Callable[[Actor], None]] = {
    "step": step,
    "turn": turn,
    "sit down": sit_down,
    "sit": sit,
    "stand up": stand_up,
    "stand": stand,
    "jump": jump,
    "kick": kick,
    "punch": punch,
    "throw": throw,
    "wave hand": wave_hand,
}
"""Every tag but walk and run, which share one gait."""
_GAIT = ("walk", "run")
_PHRASES = (
    ("walk",), ("run",), ("step",), ("turn",), ("sit down", "sit", "stand up"), ("stand",), ("jump",), ("kick",),
    ("punch",), ("throw",), ("wave hand",),
)  # fmt: skip
_BREATH = {"spine_pitch": 0.7, "left_shrug": 0.8, "right_shrug": 0.8, "head_pitch": -0.4}
"""Degrees by which a breath moves a channel."""


def session(name: str, subject: Subject, generator: np.random.Generator) -> Sequence:
    """One take: a person performs most of the actions once, in a random but plausible order."""
    actor = Actor(subject, generator)
    actor.time = LEAD
    actor.score.hold(actor.time)
    segments = []
    start = actor.frame
    for tag, end in _perform(actor, _plan(generator)):
        stop = round(end * FPS)
        segments.append(Segment(start, stop, (tag,)))
        start = stop
    curves = actor.score.read(start)
    _breathe(curves, subject, generator)
    rotations, translation = solve(curves)
    features = pack(torch.from_numpy(rotations), torch.from_numpy(translation)).float()
    return Sequence(name, name, features, tuple(segments))


def _plan(generator: np.random.Generator) -> list[str]:
    """A shuffle of the phrases without one or two of them; half of the time walk and run follow each other."""
    kept = generator.permutation(len(_PHRASES))[: len(_PHRASES) - int(generator.integers(1, 3))]
    phrases = [_PHRASES[index] for index in kept]
    if generator.random() < 0.5 and ("walk",) in phrases and ("run",) in phrases:
        pair = [("walk",), ("run",)]
        rest = [phrase for phrase in phrases if phrase not in pair]
        place = int(generator.integers(0, len(rest) + 1))
        phrases = rest[:place] + [pair[index] for index in generator.permutation(2)] + rest[place:]
    return [tag for phrase in phrases for tag in phrase]


def _perform(actor: Actor, tags: list[str]) -> list[tuple[str, float]]:
    """Act all tags; their ends in seconds. Neighbouring gaits become one stretch without a stop."""
    ends: list[tuple[str, float]] = []
    parts: list[tuple[str, float]] = []
    for index, tag in enumerate(tags):
        if tag in _GAIT:
            parts.append((tag, actor.seconds(2.2, 3.4) if tag == "walk" else actor.seconds(1.9, 2.8)))
            if index + 1 == len(tags) or tags[index + 1] not in _GAIT:
                ends += gait(actor, parts)
                parts = []
        else:
            ACTIONS[tag](actor)
            ends.append((tag, actor.time))
    return ends


def _breathe(curves: dict[str, Array], subject: Subject, generator: np.random.Generator) -> None:
    """Breath, and the small slow motion that a living body never stops."""
    time = np.arange(len(curves["x"])) / FPS
    breath = np.sin(2 * np.pi * (generator.uniform(0.22, 0.34) * time + generator.uniform()))
    for channel, depth in _BREATH.items():
        curves[channel] += depth * breath
    for channel in (*TRUNK, *(f"{side}_{part}" for side in SIDES for part in ("flex", "abduct", "rotate", "elbow"))):
        size = 0.5 if channel.startswith("pelvis") else 0.9
        curves[channel] += size * subject.restless * slow_noise(generator, time)
    for channel in ("x", "y"):
        curves[channel] += 0.0025 * subject.restless * slow_noise(generator, time, (0.15, 0.5))
