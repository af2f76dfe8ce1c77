"""States of the body, standing, bent or seated, in which at times head, arms, waist or a leg move without a purpose."""

from __future__ import annotations

from motiongen.data.sources.builtin.actions.bodyparts import MOVEMENTS
from motiongen.data.sources.builtin.actions.objects import drink, use
from motiongen.data.sources.builtin.actions.posture import HANDS_ON_THIGHS, SEAT
from motiongen.data.sources.builtin.actor import Actor
from motiongen.data.sources.builtin.score import SIDES

TABLE = 0.76
"""Height of a table that one sits at, metres."""
_BEHIND = 0.37
"""Metres from the feet to a pelvis on a chair."""


def stand_still(actor: Actor, parts: tuple[str, ...] = ()) -> None:
    """Stand; without moving parts, the weight drifts from leg to leg."""
    actor.begin()
    actor.square_up()
    start, span = actor.time, actor.seconds(1.9, 3.2)
    if not parts:
        weight = actor.uniform(0.2, 0.5) * (1.0 if actor.chance(0.5) else -1.0)
        over = start + actor.uniform(0.45, 0.6) * span
        actor.move(over, actor.between_feet(weight), height=-0.005)
        actor.pose(over, {"pelvis_roll": -3.0 * weight, "spine_roll": 2.5 * weight})
    end = max([start + span, *(MOVEMENTS[part](actor, start, span) for part in parts)])
    actor.time = end
    actor.relax(end + 0.15)
    actor.move(end + 0.05, actor.between_feet())


def bend(actor: Actor, parts: tuple[str, ...] = ()) -> None:
    """Bend the trunk forward over straight or bent legs, stay there, come up."""
    actor.begin()
    actor.square_up()
    start, span = actor.time, actor.seconds(1.1, 1.8)
    deep, knees = actor.uniform(0.75, 1.1), actor.uniform(0.0, 1.0)
    down, hang = start + actor.seconds(0.7, 0.9), 62.0 * deep
    trunk = {"pelvis_pitch": 40.0 * deep, "spine_pitch": 42.0 * deep, "head_pitch": 12.0}
    arms = {"flex": hang, "abduct": 8.0, "elbow": 16.0, "rotate": 14.0}
    actor.pose(down, trunk, 1 / actor.subject.amplitude)
    for role in ("strong", "weak"):
        actor.pose(down, {f"{role}_{name}": value for name, value in arms.items()}, 1 / actor.subject.amplitude)
    actor.move(down, actor.between_feet(), forward=-0.13 - 0.05 * knees, height=-0.03 - 0.18 * knees)
    stop = max([down + span, *(MOVEMENTS[part](actor, down, span) for part in parts)])
    actor.score.hold(stop)
    actor.time = stop + actor.seconds(0.7, 0.9)
    actor.move(actor.time, actor.between_feet())
    actor.relax(actor.time + 0.05)


def sit_still(actor: Actor, parts: tuple[str, ...] = ()) -> None:
    """Stay on the chair, hands on the thighs."""
    start, span = actor.time, actor.seconds(1.4, 2.6)
    actor.score.hold(start)
    pitch = actor.subject.slouch + actor.uniform(2.0, 10.0)
    actor.pose(start + 0.45 * span, {"spine_pitch": pitch})
    end = max([start + span, *(MOVEMENTS[part](actor, start, span) for part in parts)])
    actor.time = end
    _settle(actor, end)


def use_object_and_sit(actor: Actor) -> None:
    """Type, write or stir at a table, or drink, on the chair."""
    start = actor.time
    actor.score.hold(start)
    kind = str(actor.generator.choice(["type", "write", "stir", "drink"]))
    ready = start + actor.seconds(0.55, 0.7)
    lean = {"type": 6.0, "write": 16.0, "stir": 8.0, "drink": 0.0}[kind]
    actor.pose(ready, {"spine_pitch": actor.subject.slouch + 4.0 + lean, "head_pitch": 8.0 + lean})
    end = drink(actor, ready) if kind == "drink" else use(actor, kind, ready, TABLE)
    actor.time = end + actor.seconds(0.5, 0.65)
    _settle(actor, actor.time)


def be_seated(actor: Actor) -> None:
    """Have the session begin on a chair, at time 0."""
    actor.move(0.0, actor.between_feet(), forward=-_BEHIND, height=SEAT - actor.standing)
    actor.pose(0.0, HANDS_ON_THIGHS, 1 / actor.subject.amplitude)
    actor.pose(0.0, {"pelvis_pitch": -5.0, "spine_pitch": actor.subject.slouch + 5.0})
    for side in SIDES:
        actor.score.key(0.0, f"{side}_foot_knee", 10.0)


def _settle(actor: Actor, time: float) -> None:
    """Hands on the thighs, head and waist at rest."""
    hands = {name: value + actor.uniform(-4.0, 4.0) for name, value in HANDS_ON_THIGHS.items()}
    actor.pose(time, hands, 1 / actor.subject.amplitude)
    for arm in SIDES:
        for name in ("wrist", "shrug", "reach"):
            actor.score.key(time, f"{arm}_{name}", actor.idle[f"{arm}_{name}"])
    for name in ("head_pitch", "head_roll", "head_twist", "spine_twist", "spine_roll"):
        actor.score.key(time, name, actor.idle[name])
    actor.score.key(time, "spine_pitch", actor.subject.slouch + 5.0)
