"""Continuous sessions: who performs what in which order, and the features that come of it."""

from __future__ import annotations

import numpy as np
import torch

from motiongen.data.clips import Segment, Sequence
from motiongen.data.sources.builtin.actions.locomotion import gait
from motiongen.data.sources.builtin.actions.states import be_seated
from motiongen.data.sources.builtin.actor import Actor
from motiongen.data.sources.builtin.body import MEAN
from motiongen.data.sources.builtin.curves import Array, slow_noise
from motiongen.data.sources.builtin.ik import solve
from motiongen.data.sources.builtin.repertoire import SEATED, Act, Repertoire
from motiongen.data.sources.builtin.score import FPS, SIDES, TRUNK
from motiongen.data.sources.builtin.subjects import Subject
from motiongen.motion.representation import pack

LEAD = 0.5
"""Seconds of rest before the first action, so that it has a predecessor."""
_BREATH = {"spine_pitch": 0.7, "left_shrug": 0.8, "right_shrug": 0.8, "head_pitch": -0.4}
"""Degrees by which a breath moves a channel."""


def session(name: str, subject: Subject, generator: np.random.Generator, repertoire: Repertoire) -> Sequence:
    """One take: a person performs actions that a repertoire draws."""
    actor = Actor(subject, generator)
    acts = repertoire(generator)
    if acts[0].tags[0] in SEATED:
        be_seated(actor)
    actor.time = LEAD
    actor.score.hold(actor.time)
    segments = []
    start = actor.frame
    for act, end in zip(acts, _perform(actor, acts), strict=True):
        stop = round(end * FPS)
        segments.append(Segment(start, stop, act.tags))
        start = stop
    curves = actor.score.read(start)
    _breathe(curves, subject, generator)
    rotations, translation = solve(curves, subject.body)
    # As recordings of different people come onto one body: by leg length, so that feet stay where they stand.
    translation *= MEAN.leg_length / subject.body.leg_length
    features = pack(torch.from_numpy(rotations), torch.from_numpy(translation)).float()
    return Sequence(name, name, features, tuple(segments))


def _perform(actor: Actor, acts: list[Act]) -> list[float]:
    """Act all; their ends in seconds. Neighbouring gaits become one stretch without a stop."""
    ends: list[float] = []
    parts: list[tuple[str, float]] = []
    for index, act in enumerate(acts):
        if act.perform is None:
            tag = act.tags[0]
            parts.append((tag, actor.seconds(2.2, 3.4) if tag == "walk" else actor.seconds(1.9, 2.8)))
            if index + 1 == len(acts) or acts[index + 1].perform is not None:
                ends += [end for _, end in gait(actor, parts)]
                parts = []
        else:
            act.perform(actor)
            ends.append(actor.time)
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
