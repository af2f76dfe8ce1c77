"""Movements of a part of the body without a purpose. They are laid over a state, several at once if need be."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from motiongen.data.sources.builtin.actor import Actor, ground
from motiongen.data.sources.builtin.reach import side_of

SEATED = 0.6
"""A pelvis that is planned below this height, metres, is on a chair."""


def head_movement(actor: Actor, start: float, span: float) -> float:
    """Look to the sides, up and down, nod, or tilt the head."""
    kind = str(actor.generator.choice(["look", "up", "nod", "tilt"], p=[0.45, 0.2, 0.2, 0.15]))
    period = {"look": 1.1, "up": 1.1, "nod": 0.55, "tilt": 1.0}[kind] / actor.subject.tempo
    size = actor.uniform(0.85, 1.15) * (1.0 if actor.chance(0.5) else -1.0)
    rest = actor.score.last("head_pitch")
    time = start + 0.1
    for swing in range(max(2, round(span / period))):
        sign = size if swing % 2 == 0 else -size
        time += period * actor.uniform(0.92, 1.08) / (1 if swing else 1.6)
        actor.pose(
            time,
            {
                "look": {"head_twist": 50.0 * sign, "head_pitch": rest + 3.0},
                "up": {"head_pitch": rest + (14.0 if sign < 0 else -34.0)},
                "nod": {"head_pitch": rest + (24.0 if sign > 0 else -8.0)},
                "tilt": {"head_roll": 28.0 * sign},
            }[kind],
        )
    end = time + 0.45
    for name in ("head_pitch", "head_roll", "head_twist"):
        actor.score.key(end, name, rest if name == "head_pitch" else actor.idle[name])
    return end


def arm_movement(actor: Actor, start: float, span: float) -> float:
    """Swing the arms forward and back, raise them to the sides or the front, bend the elbows, or gesture."""
    seated = actor.score.last("height") - actor.floor < SEATED
    kinds = ["raise", "front", "curl", "gesture"] + ([] if seated else ["swing"])
    kind = str(actor.generator.choice(kinds))
    both = kind == "swing" or actor.chance(0.7)
    roles = ("strong", "weak") if both else ("strong",)
    period = {"swing": 0.55, "raise": 0.75, "front": 0.7, "curl": 0.55, "gesture": 0.42}[kind] / actor.subject.tempo
    moved = ("flex", "abduct", "elbow", "rotate")
    rest = {role: {name: actor.score.last(f"{side_of(actor, role)}_{name}") for name in moved} for role in roles}
    time = start + 0.05
    swings = 2 * max(1, round(span / (2 * period)))
    for swing in range(swings):
        out = swing % 2 == 0
        time += period * actor.uniform(0.93, 1.07)
        for role in roles:
            own, opposite = rest[role], 1.0 if (role == "strong") == out else -1.0
            pose = {
                "swing": {"flex": own["flex"] + 34.0 * opposite, "elbow": 24.0 + 10.0 * opposite},
                "raise": {"abduct": 88.0 if out else 24.0, "elbow": 14.0, "flex": 8.0, "rotate": 0.0},
                "front": {"flex": 92.0 if out else 34.0, "elbow": 14.0, "abduct": 6.0},
                "curl": {"flex": 14.0, "elbow": 122.0 if out else 34.0, "abduct": 8.0, "rotate": 8.0},
                "gesture": {
                    "flex": 34.0 + 12.0 * opposite, "elbow": 78.0 - 16.0 * opposite,
                    "abduct": 20.0 if out else 30.0, "rotate": 12.0 if out else -18.0,
                },
            }[kind]  # fmt: skip
            actor.pose(time, {f"{role}_{name}": value for name, value in pose.items()})
    end = time + 0.5
    for role in roles:
        actor.pose(end, {f"{role}_{name}": value for name, value in rest[role].items()}, 1 / actor.subject.amplitude)
    return end


def waist_movement(actor: Actor, start: float, span: float) -> float:
    """Twist the trunk, bend it to the sides, or circle with it."""
    seated = actor.score.last("height") - actor.floor < SEATED
    kind = str(actor.generator.choice(["twist", "side"] if seated else ["twist", "side", "circle"]))
    period = {"twist": 0.75, "side": 0.85, "circle": 0.4}[kind] / actor.subject.tempo
    pitch, size = actor.score.last("spine_pitch"), actor.uniform(0.9, 1.15)
    time, beats = start + 0.05, max(2, round(span / period))
    for beat in range(beats):
        sign, angle = size * (1.0 if beat % 2 == 0 else -1.0), np.pi / 2 * beat
        time += period * actor.uniform(0.94, 1.06)
        legs = {} if seated else {"pelvis_twist": 12.0 * sign}
        actor.pose(
            time,
            {
                "twist": {"spine_twist": 40.0 * sign} | legs,
                "side": {"spine_roll": 26.0 * sign},
                "circle": {
                    "spine_roll": 20.0 * size * float(np.cos(angle)),
                    "spine_pitch": pitch + 16.0 * size * float(np.sin(angle)),
                },
            }[kind],
        )
    end = time + 0.6
    for name in ("spine_twist", "spine_roll"):
        actor.score.key(end, name, actor.idle[name])
    actor.score.key(end, "spine_pitch", pitch)
    if not seated:
        actor.score.key(end, "pelvis_twist", 0.0)
    return end


def leg_movement(actor: Actor, start: float, span: float) -> float:
    """Standing on one leg, raise the other knee or swing the leg to the side; seated, stretch a knee."""
    side = actor.strong if actor.chance(0.6) else actor.weak
    other = "left" if side == "right" else "right"
    home, support = actor.foot(side), actor.foot(other)
    seated = actor.score.last("height") - actor.floor < SEATED
    kind = "stretch" if seated else str(actor.generator.choice(["knee", "side"]))
    size = actor.uniform(0.85, 1.1)
    forward, out, lift, pitch = {
        "stretch": (0.34 * size, 0.0, 0.30 * size, 12.0),
        "knee": (0.20, 0.0, 0.36 * size, -22.0),
        "side": (0.0, 0.30 * size, 0.13, -6.0),
    }[kind]
    time = start + (0.0 if seated else 0.45)
    if not seated:
        actor.move(time, 0.9 * support + 0.1 * home, height=-0.012)
        actor.score.key(time, "pelvis_roll", 0.0)
    up, down = actor.seconds(0.5, 0.6), actor.seconds(0.5, 0.6)
    target = np.array(ground(home, actor.heading, forward, actor.outward(side) * out))
    foot = f"{side}_foot_"

    def key(at: float, share: float) -> None:
        x, y = home + share * (target - home)
        for name, value in (("x", x), ("y", y), ("lift", share * lift), ("pitch", share * pitch)):
            actor.score.key(at, foot + name, value)

    for _ in range(max(1, round((span - 0.9) / (up + down + 0.2)))):
        key(time, 0.0)
        key(time + up, 1.0)
        key(time + up + 0.1, 1.0)
        if not seated:
            tilt = actor.outward(side) * (5.0 if kind == "side" else 2.0)
            actor.move(time + up, support, height=-0.008)
            actor.score.key(time + up, "pelvis_roll", tilt)
            actor.score.key(time + up, "spine_roll", -1.2 * tilt)
            for role in ("strong", "weak"):
                actor.pose(time + up, {f"{role}_abduct": 24.0, f"{role}_elbow": 24.0})
        time += up + 0.1 + down
        key(time, 0.0)
        time += 0.1
    if not seated:
        actor.score.key(time + 0.2, "pelvis_roll", 0.0)
        actor.score.key(time + 0.2, "spine_roll", 0.0)
        actor.move(time + 0.45, actor.between_feet())
        return time + 0.45
    return time + 0.1


MOVEMENTS: dict[str, Callable[[Actor, float, float], float]] = {
    "head movement": head_movement,
    "arm movement": arm_movement,
    "waist movement": waist_movement,
    "leg movement": leg_movement,
}
"""Each keys its part from `start` (seconds) for about `span` seconds and says when it is back at rest."""
