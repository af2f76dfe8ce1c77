"""Walking and running: a speed profile along a gentle curve, footsteps planned on it, phase curves for the body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from motiongen.data.sources.builtin.actor import Actor, ground
from motiongen.data.sources.builtin.curves import Array, ease, smooth
from motiongen.data.sources.builtin.score import FPS, SIDES

LEAD_IN = 0.95
"""Steps before the first landing at which the body starts to move; phase counts landings."""
TAIL = 0.35
"""Steps after the last landing at which the body has come to rest."""
_FINE = 4 * FPS
_Number = TypeVar("_Number", float, Array)


def gait(actor: Actor, parts: Sequence[tuple[str, float]]) -> list[tuple[str, float]]:
    """Walk and run from rest to rest without a stop in between.

    Args:
        actor: who moves; `time` is moved to the end.
        parts: ("walk" or "run", seconds) in order.

    Returns:
        (tag, end in seconds of the session) of every part.
    """
    actor.begin()
    start, span = actor.time, sum(seconds for _, seconds in parts)
    time = np.arange(round(span * _FINE) + 1) / _FINE
    ends = np.cumsum([seconds for _, seconds in parts])
    pace = smooth(_piecewise(parts, ends, time), 0.16 * _FINE)
    walk_speed, run_speed = 1.28 * actor.subject.stride, actor.uniform(2.05, 2.5) * actor.subject.stride
    tempo = actor.subject.tempo**0.6
    cadence = tempo * ((1 - pace) * 1.85 + pace * 2.8)
    steps = max(3, round(float(cadence.mean()) * span - LEAD_IN - TAIL))
    phase = np.cumsum(np.append(0.0, cadence[:-1])) / _FINE
    phase = phase * (steps + LEAD_IN + TAIL) / phase[-1] - LEAD_IN
    speed = tempo * ((1 - pace) * walk_speed + pace * run_speed)
    # A runner needs longer to come up to speed and to brake.
    speed = (
        speed
        * ease(phase, -LEAD_IN, 0.9 + 0.5 * pace[0])
        * (1 - ease(phase, steps - 1.5 - 0.8 * pace[-1], steps + TAIL))
    )
    path, heading = _path(actor, speed, time)
    _Gait(actor, start, time, phase, pace, path, heading, speed / np.maximum(walk_speed, 1e-6), steps).write()
    actor.time = start + span
    return [(tag, start + float(end)) for (tag, _), end in zip(parts, ends, strict=True)]


def _piecewise(parts: Sequence[tuple[str, float]], ends: Array, time: Array) -> Array:
    running = np.array([float(tag == "run") for tag, _ in parts])
    return running[np.minimum(np.searchsorted(ends, time, side="right"), len(parts) - 1)]


def _path(actor: Actor, speed: Array, time: Array) -> tuple[Array, Array]:
    """Places (N, 2) and headings (N,) in degrees along a gentle curve."""
    bend = actor.uniform(-28.0, 28.0)  # degrees per metre
    bend *= 0.0 if actor.chance(0.3) else 1.0
    wander = np.sin(2 * np.pi * time * actor.uniform(0.1, 0.25) + actor.uniform(0, 6.28))
    rate = speed * (bend * np.minimum(1.0, 1.3 / np.maximum(speed, 1.3)) + 5.0 * wander)
    heading = actor.heading + np.cumsum(rate) / _FINE
    angle = np.deg2rad(heading)
    velocity = speed[:, None] * np.stack([np.sin(angle), -np.cos(angle)], axis=-1)
    return actor.place + np.cumsum(velocity, axis=0) / _FINE, heading


class _Gait:
    """Writes one stretch of locomotion into the score. Arrays run over the fine time grid of the stretch."""

    def __init__(
        self,
        actor: Actor,
        start: float,
        time: Array,
        phase: Array,
        pace: Array,
        path: Array,
        heading: Array,
        speed: Array,
        steps: int,
    ) -> None:
        self.actor, self.start, self.time, self.phase, self.steps = actor, start, time, phase, steps
        self.pace, self.path, self.heading = pace, path, heading
        self.effort = np.clip(speed, 0.0, 1.3)
        first = actor.rear() if np.linalg.norm(actor.foot("left") - actor.foot("right")) > 0.3 else actor.strong
        self.order = (first, "left" if first == "right" else "right")

    def write(self) -> None:
        self._root()
        for index, side in enumerate(self.order):
            self._feet(side, index)
        self._body()

    def at(self, phase: float, values: Array) -> float:
        return float(np.interp(phase, self.phase, values))

    def when(self, phase: float) -> float:
        """Seconds of the session at a phase."""
        return self.start + float(np.interp(phase, self.phase, self.time))

    def _root(self) -> None:
        score = self.actor.score
        for frame in range(1, int(self.time[-1] * FPS) + 1):
            now = min(frame * _FINE // FPS, len(self.time) - 1)
            score.key(self.start + frame / FPS, "x", self.path[now, 0])
            score.key(self.start + frame / FPS, "y", self.path[now, 1])
            score.key(self.start + frame / FPS, "heading", self.heading[now])

    def _landing(self, step: int) -> tuple[Array, float]:
        """Place (2,) and heading of the foot that lands at a phase: under the pelvis at the middle of its stance."""
        side = self.order[step % 2]
        pace = self.at(step, self.pace)
        middle = step + _duty(pace)
        point = np.array([self.at(middle, self.path[:, 0]), self.at(middle, self.path[:, 1])])
        heading = self.at(step + 0.3, self.heading)
        settled = float(ease(middle, self.steps - 1.2, self.steps))
        width = self.actor.subject.stance_width * ((0.85 - 0.35 * pace) * (1 - settled) + settled)
        ahead = (0.02 - 0.06 * pace) * (1 - settled)
        return np.array(ground(point, heading, ahead, self.actor.outward(side) * width)), heading

    def _feet(self, side: str, index: int) -> None:
        score, foot = self.actor.score, f"{side}_foot_"

        def key(phase: float, **values: float) -> None:
            for name, value in values.items():
                score.key(self.when(phase), foot + name, value)

        landing = index
        first = True
        while landing <= self.steps:
            pace = self.at(landing - 1, self.pace)
            effort = float(np.clip(self.at(landing - 0.6, self.effort), 0.35, 1.2))
            off = landing - 2 + 2 * _duty(pace)
            place = {name: score.last(foot + name) for name in ("x", "y", "yaw")}
            push = (26.0 if first else 50.0 + 8.0 * pace) * min(effort + 0.15, 1.0)
            flat_until = off - (0.30 if first else 0.50 - 0.12 * pace)
            key(flat_until, lift=0.0, pitch=0.0)
            key(off, lift=0.0, pitch=-push)
            target, heading = self._landing(landing)
            swing = landing - off
            key(off + 0.08 * (1 - pace) * swing, **place)
            last = landing > self.steps - 2
            high = 0.035 + pace * 0.13 * effort
            strike = (17.0 - 13.0 * pace) * effort * (0.4 if last else 1.0)
            key(off + 0.40 * swing, lift=high, pitch=-push * (0.55 + 0.25 * pace))
            key(off + 0.75 * swing, lift=0.6 * high if pace > 0.5 else 0.022, pitch=0.4 * strike)
            # The foot arrives before it touches, so that it does not slide into its stance.
            key(landing - 0.06 * (1 - pace) * swing, x=target[0], y=target[1], yaw=heading + self.actor.toe_out(side))
            key(landing, lift=0.0, pitch=strike)
            key(landing + 0.16, pitch=0.0)
            landing += 2
            first = False

    def _body(self) -> None:
        actor, subject, phase, pace = self.actor, self.actor.subject, self.phase, self.pace
        envelope = ease(phase, -LEAD_IN, 0.2) * (1 - ease(phase, self.steps - 0.8, self.steps + TAIL))
        side = actor.outward(self.order[0])
        wide = subject.amplitude * envelope * np.clip(0.25 + 0.75 * self.effort, 0.0, 1.15)
        swing = np.cos(np.pi * (phase - 0.04))  # +1 when the first foot lands in front
        stance = np.cos(np.pi * (phase - _duty(pace)))  # +1 in the middle of the first foot's stance
        strides = 2 * np.pi * (phase - 2 * _duty(pace) + 1)
        bounce = subject.bounce * (
            -(1 - pace) * 0.017 * np.cos(strides) - pace * 0.036 * np.cos(2 * np.pi * (phase - 0.36))
        )
        lean = wide * pace
        self._layer("height", envelope * (bounce - 0.010 * (1 - pace) - 0.060 * pace))
        left = np.stack([np.cos(np.deg2rad(self.heading)), np.sin(np.deg2rad(self.heading))], axis=-1)
        sway = subject.sway * envelope * side * stance * (0.030 - 0.016 * pace)
        self._layer("x", sway * left[:, 0])
        self._layer("y", sway * left[:, 1])
        twist = -side * swing * wide * (6.0 + 3.0 * pace)
        self._layer("pelvis_twist", twist)
        self._layer("pelvis_roll", side * stance * wide * subject.sway * (4.0 - 0.5 * pace))
        self._layer("pelvis_pitch", 2.0 * wide + 7.0 * lean)
        self._layer("spine_twist", -twist * (2.2 - 0.8 * subject.stiffness))
        self._layer("spine_roll", -side * stance * wide * subject.sway * 3.5)
        self._layer("spine_pitch", 9.0 * lean + 1.2 * wide * np.cos(strides))
        self._layer("head_pitch", -2.0 * lean)
        for arm in SIDES:
            own = side * actor.outward(arm)
            forward = -own * swing  # an arm goes with the other leg
            self._layer(f"{arm}_flex", wide * ((20.0 + 14.0 * pace) * forward + 3.0 - 6.0 * pace))
            bend = (9.0 + 3.0 * pace) * (forward + 0.5) + 66.0 * pace
            self._layer(f"{arm}_elbow", wide * bend)
            self._layer(f"{arm}_abduct", wide * (1.0 + 6.0 * pace))
            self._layer(f"{arm}_rotate", wide * (4.0 * forward + 12.0 * pace))
            self._layer(f"{arm}_reach", wide * 4.0 * forward)

    def _layer(self, channel: str, values: Array) -> None:
        first = int(np.ceil(self.start * FPS - 1e-6))
        frames = np.arange(first, int(np.floor((self.start + self.time[-1]) * FPS + 1e-6)) + 1)
        self.actor.score.layer(channel, first, np.interp(frames / FPS - self.start, self.time, values))


def _duty(pace: _Number) -> _Number:
    """Share of a stride that a foot stands, which is half its stance in steps: 0.62 walking, 0.36 running."""
    return 0.62 - 0.26 * pace
