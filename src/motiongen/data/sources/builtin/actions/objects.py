"""Hands on things that are not there: take up, place down, move, touch, use."""

from __future__ import annotations

import numpy as np

from motiongen.data.sources.builtin.actor import Actor, ground
from motiongen.data.sources.builtin.curves import Array
from motiongen.data.sources.builtin.reach import before, hand, landmark, side_of

_Place = tuple[float, float, float]
_HELD: _Place = (0.06, 1.12, 0.34)
"""Where a thing is held before the chest: outward, above the floor, forward of the pelvis."""


def take_something_up(actor: Actor) -> None:
    """Reach for a thing on a shelf, a table or the floor, grasp it, draw it to the chest, lower it."""
    actor.begin()
    actor.square_up()
    hands, height = _hands(actor, 0.45), _height(actor)
    reach, lift = actor.seconds(0.75, 0.95), actor.seconds(0.65, 0.85)
    grasp = actor.time + reach
    _reach_for(actor, grasp, hands, height)
    actor.score.hold(grasp + 0.16)
    held = grasp + 0.16 + lift
    _hold_before_chest(actor, held, hands)
    actor.score.hold(held + 0.3)
    actor.time = held + 0.3 + actor.seconds(0.45, 0.6)
    actor.move(actor.time, actor.between_feet())
    actor.relax(actor.time + 0.1)


def place_something_down(actor: Actor) -> None:
    """Bring a thing up before the chest, put it on a shelf, a table or the floor, let go, withdraw the empty hands."""
    actor.begin()
    actor.square_up()
    hands, height = _hands(actor, 0.45), _height(actor)
    held = actor.time + actor.seconds(0.5, 0.65)
    _hold_before_chest(actor, held, hands)
    actor.score.hold(held + 0.25)
    put = held + 0.25 + actor.seconds(0.8, 1.0)
    _reach_for(actor, put, hands, height)
    actor.score.hold(put + 0.14)
    actor.time = put + 0.14 + actor.seconds(0.6, 0.75)
    actor.move(actor.time, actor.between_feet())
    actor.relax(actor.time)


def move_something(actor: Actor) -> None:
    """Shift a thing across a table from one side to the other, or push or pull it with both hands."""
    actor.begin()
    actor.square_up()
    start, up = actor.time, actor.uniform(0.88, 1.05)
    across = actor.chance(0.55)
    far, near = actor.uniform(0.56, 0.62), actor.uniform(0.30, 0.36)
    ready, shift = start + actor.seconds(0.65, 0.8), actor.seconds(1.0, 1.3)
    side = (1.0 if actor.chance(0.5) else -1.0) * actor.uniform(0.22, 0.32)
    if across:
        ends = ((side, 0.44), (-side, 0.44))
    else:
        ends = ((0.0, near), (0.0, far)) if actor.chance(0.55) else ((0.0, far), (0.0, near))
    times = (ready, ready + 0.10, ready + 0.10 + shift, ready + 0.25 + shift)
    for time, (left, forward) in zip(times, (ends[0], ends[0], ends[1], ends[1]), strict=True):
        actor.score.key(time, "spine_twist", 75.0 * left)
        actor.score.key(time, "pelvis_twist", 25.0 * left)
        bend = 6.0 + 26.0 * max(forward - 0.40, 0.0) / 0.2
        actor.pose(
            time, {"pelvis_pitch": 0.4 * bend, "spine_pitch": actor.subject.slouch + 0.7 * bend, "head_pitch": 18.0}
        )
        weight = np.sign(actor.outward(actor.strong)) * np.clip(left / 0.3, -0.5, 0.5)
        actor.move(time, actor.between_feet(float(weight)), forward=0.3 * (forward - 0.44), height=-0.03)
        for role in ("strong", "weak"):
            own = actor.outward(side_of(actor, role))
            hand(actor, time, role, before(actor, role, 0.13 + own * left, up, forward), elbow=(0.7, -0.3))
    actor.time = times[-1] + actor.seconds(0.5, 0.65)
    actor.move(actor.time, actor.between_feet())
    actor.relax(actor.time)


def touch_something(actor: Actor) -> None:
    """Stretch one arm out to a thing at the height of chest or face; rest the hand on it, or tap it; come back."""
    actor.begin()
    role = "strong" if actor.chance(0.8) else "weak"
    out, up, forward = actor.uniform(-0.05, 0.28), actor.uniform(1.08, 1.55), actor.uniform(0.56, 0.64)
    arrive = actor.time + actor.seconds(0.6, 0.8)
    toward = actor.outward(side_of(actor, role))
    actor.score.key(arrive, "spine_twist", -7.0 * toward)
    actor.pose(arrive, {"spine_pitch": actor.subject.slouch + 5.0, "head_pitch": 26.0 * (1.35 - up) / 0.3})
    actor.move(arrive, actor.between_feet(), forward=0.03, height=-0.01)
    taps = int(actor.generator.integers(1, 4)) if actor.chance(0.5) else 0
    time = arrive
    hand(actor, time, role, before(actor, role, out, up, forward))
    for _ in range(taps):
        beat = actor.seconds(0.17, 0.22)
        hand(actor, time + beat, role, before(actor, role, out, up, forward - 0.09))
        hand(actor, time + 2 * beat, role, before(actor, role, out, up, forward))
        time += 2 * beat
    if not taps:
        time += actor.seconds(0.6, 1.1)
        slide = actor.uniform(-0.07, 0.07)
        hand(actor, time, role, before(actor, role, out + slide, up + 0.5 * slide, forward))
    actor.score.hold(time + 0.1)
    actor.time = time + 0.1 + actor.seconds(0.55, 0.7)
    actor.move(actor.time, actor.between_feet())
    actor.relax(actor.time)


def use_object(actor: Actor) -> None:
    """Hammer, stir, wipe or drink, standing."""
    actor.begin()
    kind = str(actor.generator.choice(["hammer", "stir", "wipe", "drink"]))
    ready = actor.time + actor.seconds(0.55, 0.7)
    bend = {"hammer": 10.0, "stir": 5.0, "wipe": 16.0, "drink": 0.0}[kind]
    actor.pose(
        ready, {"spine_pitch": actor.subject.slouch + bend, "pelvis_pitch": 0.5 * bend, "head_pitch": 1.6 * bend}
    )
    actor.move(ready, actor.between_feet(0.15), height=-0.012)
    end = drink(actor, ready) if kind == "drink" else use(actor, kind, ready, actor.uniform(0.98, 1.06))
    actor.time = end + actor.seconds(0.5, 0.65)
    actor.move(actor.time, actor.between_feet())
    actor.relax(actor.time)


def use(actor: Actor, kind: str, ready: float, table: float) -> float:
    """Key the hands that do something at a table of some height from `ready` on; the end in seconds."""
    period = {"hammer": 0.46, "stir": 0.62, "wipe": 0.9, "type": 0.36, "write": 0.5}[kind] / actor.subject.tempo
    beats = round(actor.seconds(1.5, 2.2) / period)
    time = ready
    for beat in range(4 * beats + 1):
        around = 2 * np.pi * beat / 4
        cos, sin = float(np.cos(around)), float(np.sin(around))
        places: dict[str, tuple[_Place, _Place | None]] = {
            "hammer": ((0.05, 0.12 + 0.12 * cos, 0.38), (0.02, -0.02, 0.36)),
            "stir": ((0.02 + 0.075 * cos, 0.06, 0.36 + 0.075 * sin), (0.02, 0.0, 0.36)),
            "wipe": ((0.06 + 0.20 * cos, -0.10, 0.46 + 0.06 * sin), None),
            "type": ((0.10, 0.06 + 0.022 * sin, 0.38), (0.10, 0.06 - 0.022 * sin, 0.38)),
            "write": (
                (0.02 + 0.08 * (beat / beats - 2) / 2, 0.05 + 0.012 * sin, 0.36 + 0.02 * cos),
                (0.12, 0.05, 0.32),
            ),
        }
        for role, place in zip(("strong", "weak"), places[kind], strict=True):
            if place is not None:
                out, up, forward = place
                hand(actor, time, role, before(actor, role, out, table + up, forward))
        time += period / 4 * actor.uniform(0.94, 1.06)
    return time


def drink(actor: Actor, ready: float) -> float:
    """Take a cup from before the chest to the mouth, tip the head back, bring it down; the end in seconds."""
    chest = before(actor, "strong", 0.06, float(actor.score.last("height")) - actor.floor + 0.22, 0.34)
    hand(actor, ready, "strong", chest)
    sip = ready + actor.seconds(0.5, 0.65)
    actor.pose(sip, {"head_pitch": actor.subject.chin - 4.0})
    hand(actor, sip, "strong", landmark(actor, "strong", "mouth"), elbow=(0.9, 0.3))
    tipped = sip + actor.seconds(0.5, 0.8)
    actor.pose(tipped, {"head_pitch": actor.subject.chin - 20.0})
    hand(actor, tipped, "strong", landmark(actor, "strong", "mouth"), elbow=(1.3, 0.5))
    down = tipped + actor.seconds(0.5, 0.65)
    actor.pose(down, {"head_pitch": actor.subject.chin + 6.0})
    hand(actor, down, "strong", chest)
    return down


def _hands(actor: Actor, both: float) -> tuple[str, ...]:
    return ("strong", "weak") if actor.chance(both) else ("strong",)


def _height(actor: Actor) -> float:
    """Of a shelf, a table, or a thing on the floor, metres."""
    low, high = ((1.25, 1.55), (0.75, 0.95), (0.12, 0.40))[int(actor.generator.choice(3, p=[0.25, 0.45, 0.30]))]
    return actor.uniform(low, high)


def _reach_for(actor: Actor, time: float, hands: tuple[str, ...], height: float) -> None:
    """Bend and crouch as far as a height asks for, and put the palms there."""
    low = float(np.clip((1.08 - height) / 0.95, 0.0, 1.0))
    forward = 0.50 - 0.06 * low
    actor.pose(
        time,
        {
            "pelvis_pitch": 4.0 + 42.0 * low,
            "spine_pitch": actor.subject.slouch + 5.0 + 36.0 * low,
            "head_pitch": 8.0 + 22.0 * low - 24.0 * max(height - 1.2, 0.0),
        },
        1 / actor.subject.amplitude,
    )
    actor.move(time, actor.between_feet(), forward=0.03 - 0.17 * low, height=-0.01 - 0.36 * low)
    for role in ("strong", "weak"):
        if role in hands:
            place = _from_feet(actor, role, 0.12 if len(hands) == 2 else 0.08, height, forward)
            hand(actor, time, role, place, elbow=(0.6, -0.2))
        elif low > 0.3:
            actor.pose(time, {f"{role}_flex": 50.0 * low, f"{role}_elbow": 50.0, f"{role}_rotate": 30.0})


def _hold_before_chest(actor: Actor, time: float, hands: tuple[str, ...]) -> None:
    actor.pose(time, {"pelvis_pitch": 0.0, "spine_pitch": actor.subject.slouch, "head_pitch": 18.0})
    actor.move(time, actor.between_feet(), height=-0.006)
    for role in ("strong", "weak"):
        if role in hands:
            out, up, forward = _HELD
            hand(actor, time, role, before(actor, role, out + 0.06 * (len(hands) == 2), up, forward))
        else:
            side = side_of(actor, role)
            for name in ("flex", "elbow", "rotate"):
                actor.score.key(time, f"{side}_{name}", actor.idle[f"{side}_{name}"])


def _from_feet(actor: Actor, role: str, out: float, up: float, forward: float) -> Array:
    """`before`, but measured from the middle of the feet, which a crouch does not move."""
    x, y = ground(actor.between_feet(), actor.heading, forward, actor.outward(side_of(actor, role)) * out)
    return np.array([x, y, actor.floor + up])
