"""Walking that is planned step by step: backward, sideways, up and down stairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motiongen.data.sources.builtin.actor import Actor, ground
from motiongen.data.sources.builtin.curves import Array
from motiongen.data.sources.builtin.score import SIDES

RISE = (0.13, 0.18)
"""Metres from one stair to the next."""
TREAD = (0.27, 0.31)
"""Metres from the edge of one stair to that of the next."""


@dataclass(frozen=True)
class _Fall:
    """A foot that comes down somewhere."""

    side: str
    place: Array
    floor: float
    """Height of what it comes down on, metres."""


def walk_backward(actor: Actor) -> None:
    """Four to six steps back: toes land first, the trunk leans a little forward, at times a look over the shoulder."""
    actor.begin()
    actor.square_up()
    length = actor.uniform(0.34, 0.46) * actor.subject.stride
    count = int(actor.generator.integers(4, 7))
    first = actor.strong if actor.chance(0.6) else actor.weak
    middle, falls = actor.between_feet(), []
    for index in range(count):
        back = -length * (min(index, count - 2) + 1)
        side = first if index % 2 == 0 else _other(first)
        center = np.array(ground(middle, actor.heading, back, 0.0))
        falls.append(_Fall(side, actor.stance(side, center, actor.heading), actor.floor))
    if actor.chance(0.5):
        look = actor.uniform(30.0, 55.0) * (1.0 if actor.chance(0.5) else -1.0)
        actor.pose(actor.time + 0.5, {"head_twist": look, "head_pitch": 10.0})
        actor.pose(actor.time + 1.6, {"head_twist": 0.9 * look, "head_pitch": 8.0})
    _pace(actor, falls, actor.seconds(0.56, 0.66), lift=0.045, heel=14.0, lean=5.0, swing=-8.0)


def walk_sideway(actor: Actor) -> None:
    """Two to four steps to one side: the leading foot steps out, the other closes up to it and never crosses it."""
    actor.begin()
    actor.square_up()
    lead = actor.strong if actor.chance(0.5) else actor.weak
    length = actor.uniform(0.30, 0.44) * actor.subject.stride
    middle, falls = actor.between_feet(), []
    for index in range(int(actor.generator.integers(2, 5))):
        center = np.array(ground(middle, actor.heading, 0.0, actor.outward(lead) * length * (index + 1)))
        falls += [_Fall(side, actor.stance(side, center, actor.heading), actor.floor) for side in (lead, _other(lead))]
    look = actor.outward(lead) * actor.uniform(15.0, 45.0)
    actor.score.key(actor.time + 0.4, "head_twist", look)
    _pace(actor, falls, actor.seconds(0.44, 0.52), lift=0.045, heel=12.0, lean=2.0, swing=0.0)


def climb_or_descend(actor: Actor) -> None:
    """From the floor three to five stairs up, on top of them as many down to the floor again."""
    if actor.floor > 0:
        count = round(actor.floor / float(np.mean(RISE)))
        _stairs(actor, count, -actor.floor / count)
    else:
        _stairs(actor, int(actor.generator.integers(3, 6)), actor.uniform(*RISE))


def _stairs(actor: Actor, count: int, rise: float) -> None:
    actor.begin()
    actor.square_up()
    middle, tread = actor.between_feet(), actor.uniform(*TREAD)
    first = actor.strong if actor.chance(0.6) else actor.weak
    bottom, falls = actor.floor, []
    for index in range(count + 1):
        stair = min(index + 1, count)
        side = first if index % 2 == 0 else _other(first)
        center = np.array(ground(middle, actor.heading, tread * stair, 0.0))
        # A descent ends on the floor exactly, whatever rounding does to the sum of its stairs.
        floor = 0.0 if rise < 0 and stair == count else bottom + rise * stair
        falls.append(_Fall(side, actor.stance(side, center, actor.heading), floor))
    actor.pose(actor.time + 0.5, {"head_pitch": 18.0})
    lean, swing = (9.0, 12.0) if rise > 0 else (3.0, 9.0)
    _pace(actor, falls, actor.seconds(0.58, 0.70), lift=0.07, heel=26.0, lean=lean, swing=swing)


def _pace(
    actor: Actor, falls: Sequence[_Fall], beat: float, *, lift: float, heel: float, lean: float, swing: float
) -> None:
    """Let the feet come down one after another, a beat each, and carry the body over them to rest beside the last.

    `lean` bends the trunk forward, `swing` (degrees) takes the arm of the standing leg forward.
    """
    score, start, size = actor.score, actor.time, actor.subject.amplitude
    actor.pose(start + 0.8 * beat, {"pelvis_pitch": 0.4 * lean, "spine_pitch": actor.idle["spine_pitch"] + lean})
    for index, fall in enumerate(falls):
        leave, land = start + (index + 0.10) * beat, start + (index + 0.92) * beat
        support = _other(fall.side)
        below, from_floor = score.last(f"{support}_foot_ground"), score.last(f"{fall.side}_foot_ground")
        # The body sways over the standing foot while the other swings, and is between both when it lands.
        middle = actor.between_feet()
        ahead = actor.foot(support) - middle
        travel = fall.place - actor.foot(fall.side)
        along = travel / max(float(np.linalg.norm(travel)), 1e-6)
        forward = (ahead @ along) * along
        over = middle + forward + 0.35 * actor.subject.sway * (ahead - forward)
        actor.floor = below
        actor.move(start + (index + 0.5) * beat, over, height=-0.012)
        _swing_foot(actor, fall, leave, land, from_floor, lift=lift, heel=heel)
        # Going up, the body is lifted once it is over the upper foot; going down, it sinks towards the lower one.
        actor.floor = below + (0.15 if fall.floor > below else 0.7) * (fall.floor - below)
        actor.move(start + (index + 1) * beat, actor.between_feet(), height=-0.022)
        for arm in SIDES:
            forward_arm = swing * size * (1.0 if arm == support else -0.7)
            score.key(start + (index + 1) * beat, f"{arm}_flex", actor.idle[f"{arm}_flex"] + forward_arm)
            score.key(start + (index + 1) * beat, f"{arm}_elbow", actor.idle[f"{arm}_elbow"] + 0.6 * abs(swing) * size)
        side = actor.outward(fall.side)
        score.key(start + (index + 0.5) * beat, "pelvis_roll", -1.5 * side * actor.subject.sway)
        score.key(start + (index + 1) * beat, "spine_twist", 0.35 * side * swing)
    actor.floor = falls[-1].floor
    actor.time = start + (len(falls) + 0.45) * beat
    actor.move(actor.time, actor.between_feet())
    actor.relax(actor.time + 0.1)


def _swing_foot(
    actor: Actor, fall: _Fall, leave: float, land: float, from_floor: float, *, lift: float, heel: float
) -> None:
    """`Actor.step` to ground of another height: the foot is raised before it travels up, and lowered after it."""
    actor.step(fall.side, leave, land, fall.place, actor.heading + actor.toe_out(fall.side), lift=lift, heel=heel)
    up = fall.floor > from_floor
    early, late = (0.10, 0.62) if up else (0.40, 0.97)
    span = land - leave
    actor.score.key(leave + early * span, f"{fall.side}_foot_ground", from_floor)
    actor.score.key(leave + late * span, f"{fall.side}_foot_ground", fall.floor)


def _other(side: str) -> str:
    return "left" if side == "right" else "right"
