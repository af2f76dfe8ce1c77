"""Actions of the whole body over feet that stay: stand, jump, sit down, sit, stand up."""

from __future__ import annotations

import numpy as np

from motiongen.data.sources.builtin.actor import Actor, ground
from motiongen.data.sources.builtin.curves import ease
from motiongen.data.sources.builtin.score import FPS

GRAVITY = 9.81
SEAT = 0.47
"""Height of the pelvis on a chair, metres."""
HANDS_ON_THIGHS = {
    "strong_flex": 33.0, "strong_abduct": 9.0, "strong_rotate": 14.0, "strong_elbow": 22.0,
    "weak_flex": 31.0, "weak_abduct": 10.0, "weak_rotate": 16.0, "weak_elbow": 25.0,
}  # fmt: skip


def stand(actor: Actor) -> None:
    """Stand at ease: the weight drifts from leg to leg, the eyes wander, at times a hand moves a little."""
    actor.begin()
    start, span = actor.time, actor.seconds(1.6, 3.2)
    weight = actor.uniform(0.25, 0.6) * (1.0 if actor.chance(0.5) else -1.0)
    over = start + actor.uniform(0.45, 0.6) * span
    actor.move(over, actor.between_feet(weight), height=-0.006)
    actor.pose(over, {"pelvis_roll": -3.0 * weight, "spine_roll": 2.5 * weight, "pelvis_twist": 2.0 * weight})
    if actor.chance(0.6):
        look = actor.uniform(-32.0, 32.0)
        actor.pose(start + 0.35 * span, {"head_twist": look, "spine_twist": 0.15 * look})
        actor.pose(start + 0.60 * span, {"head_twist": 0.85 * look, "spine_twist": 0.12 * look})
    if actor.chance(0.3):
        arm = "strong" if actor.chance(0.5) else "weak"
        actor.pose(start + 0.5 * span, {f"{arm}_flex": 8.0, f"{arm}_elbow": 34.0, f"{arm}_rotate": 20.0}, 0.8)
    actor.time = start + span
    actor.relax(actor.time)
    actor.move(actor.time, actor.between_feet(0.3 * weight))


def jump(actor: Actor) -> None:
    """Crouch with the arms back, extend, fly ballistically, absorb, come up. Upward or some way forward."""
    actor.begin()
    actor.square_up()
    start, heading, score = actor.time, actor.heading, actor.score
    rise = actor.uniform(0.14, 0.30) * actor.subject.amplitude
    reach = actor.uniform(0.25, 0.75) * actor.subject.stride if actor.chance(0.6) else 0.0
    crouch, push = actor.seconds(0.48, 0.62), actor.uniform(0.22, 0.26)
    absorb, recover = actor.seconds(0.20, 0.25), actor.seconds(0.42, 0.55)
    flight = 2 * np.sqrt(2 * rise / GRAVITY)
    depth = -(0.16 + 0.35 * rise) * actor.uniform(0.9, 1.15)
    off = start + crouch + push
    landed = off + flight
    origin = actor.between_feet()

    actor.move(start + crouch, origin, forward=-0.035, height=depth)
    actor.pose(start + 0.95 * crouch, {"pelvis_pitch": 26.0, "spine_pitch": 24.0, "head_pitch": -4.0})
    for arm in ("strong", "weak"):
        actor.pose(start + 0.4 * crouch, {f"{arm}_flex": 20.0, f"{arm}_elbow": 35.0})
        actor.pose(
            start + crouch, {f"{arm}_flex": -14.0, f"{arm}_abduct": 12.0, f"{arm}_elbow": 22.0, f"{arm}_rotate": 0.0}
        )
        high = 100.0 + 90.0 * rise - 20.0 * (reach > 0)
        actor.pose(off + 0.12, {f"{arm}_flex": high, f"{arm}_abduct": 18.0, f"{arm}_elbow": 34.0, f"{arm}_shrug": 6.0})
        actor.pose(off + 0.12 + 0.5 * flight, {f"{arm}_flex": 0.8 * high, f"{arm}_abduct": 28.0, f"{arm}_elbow": 42.0})
    actor.pose(off, {"pelvis_pitch": 3.0 + 8.0 * reach, "spine_pitch": -3.0, "head_pitch": -6.0})
    actor.pose(off + 0.5 * flight, {"pelvis_pitch": 10.0 * reach, "spine_pitch": 6.0, "head_pitch": 4.0})

    # The pelvis flies on a parabola from toe-off, with straight legs on raised heels, to touch-down with bent ones.
    tall = 0.070
    fly = np.linspace(0.0, 1.0, max(4, round(flight * FPS)))
    for share in fly:
        time = off + share * flight
        x, y = ground(origin, heading, reach * (0.08 + 0.84 * share), 0.0)
        score.key(time, "x", x)
        score.key(time, "y", y)
        drop = 0.10 * share
        score.key(time, "height", actor.standing + tall + 4 * rise * share * (1 - share) - drop)
    for side in ("left", "right"):
        foot = f"{side}_foot_"
        x, y = ground(actor.foot(side), heading, reach, 0.0)
        tuck = actor.uniform(0.06, 0.14)
        late = actor.uniform(-0.008, 0.008)
        score.key(start + crouch + 0.25 * push, foot + "pitch", 0.0)
        score.key(off + late, foot + "pitch", -52.0)
        score.key(off + 0.45 * flight, foot + "pitch", -30.0)
        score.key(landed + late, foot + "pitch", -8.0 if reach == 0 else 4.0)
        score.key(landed + 0.10 + late, foot + "pitch", 0.0)
        for name, value in (("x", x), ("y", y)):
            score.key(off, foot + name, score.last(foot + name))
            score.key(landed, foot + name, value)
        score.key(off, foot + "lift", 0.0)
        for share in fly[1:-1]:
            up = 4 * rise * share * (1 - share)
            score.key(
                off + late + share * flight,
                foot + "lift",
                up * float(ease(share, -0.35, 0.35)) + tuck * np.sin(np.pi * share) ** 2,
            )
        score.key(landed + late, foot + "lift", 0.0)

    low = landed + absorb
    actor.move(low, actor.between_feet(), forward=-0.03, height=0.75 * depth)
    actor.pose(low, {"pelvis_pitch": 20.0, "spine_pitch": 18.0, "head_pitch": 2.0})
    for arm in ("strong", "weak"):
        actor.pose(low + 0.02, {f"{arm}_flex": 24.0, f"{arm}_abduct": 24.0, f"{arm}_elbow": 48.0, f"{arm}_shrug": 0.0})
    actor.time = low + recover
    actor.move(actor.time, actor.between_feet())
    actor.pose(low + 0.8 * recover, {"strong_flex": -6.0, "weak_flex": -6.0})
    actor.relax(actor.time + 0.2)


def sit_down(actor: Actor) -> None:
    """Lower the body onto a chair behind it: bend forward as the hips go back, then come upright."""
    actor.begin()
    actor.square_up()
    start, span = actor.time, actor.seconds(1.35, 1.75)
    middle, back = actor.between_feet(), -actor.uniform(0.34, 0.40)
    seat = SEAT - actor.standing + actor.uniform(-0.02, 0.03)
    bend = actor.uniform(0.85, 1.15)
    if actor.chance(0.4):
        actor.pose(start + 0.22 * span, {"head_twist": -28.0, "spine_twist": -8.0, "head_pitch": 12.0})
    actor.move(start + 0.22 * span, middle, forward=-0.04, height=-0.035)
    actor.pose(start + 0.28 * span, {"pelvis_pitch": 14.0 * bend, "spine_pitch": 16.0 * bend})
    actor.pose(
        start + 0.62 * span,
        {"pelvis_pitch": 34.0 * bend, "spine_pitch": 24.0 * bend, "head_twist": 0.0, "spine_twist": 0.0},
    )
    reach = HANDS_ON_THIGHS | {"strong_flex": 58.0, "weak_flex": 55.0, "strong_elbow": 30.0, "weak_elbow": 32.0}
    actor.pose(start + 0.60 * span, reach)
    actor.move(start + 0.60 * span, middle, forward=0.72 * back, height=0.62 * seat)
    actor.move(start + 0.86 * span, middle, forward=back, height=seat - 0.008)
    actor.pose(start + 0.93 * span, {"pelvis_pitch": 2.0, "spine_pitch": actor.subject.slouch + 7.0})
    actor.pose(start + 1.02 * span, HANDS_ON_THIGHS, 1 / actor.subject.amplitude)
    for side in ("left", "right"):
        actor.score.key(start + 0.3 * span, f"{side}_foot_knee", 4.0)
        actor.score.key(start + 0.9 * span, f"{side}_foot_knee", 10.0)
    actor.time = start + span
    actor.move(actor.time, middle, forward=back - 0.01, height=seat)
    actor.pose(actor.time, {"pelvis_pitch": -5.0})


def sit(actor: Actor) -> None:
    """Stay seated for a while, breathe, look about."""
    start, span = actor.time, actor.seconds(1.1, 2.2)
    actor.score.hold(start)
    pitch = actor.subject.slouch + actor.uniform(2.0, 12.0)
    look = actor.uniform(-30.0, 30.0)
    actor.pose(start + 0.45 * span, {"spine_pitch": pitch, "head_twist": look, "spine_twist": 0.25 * look})
    hands = {name: value + actor.uniform(-4.0, 4.0) for name, value in HANDS_ON_THIGHS.items()}
    actor.pose(start + 0.45 * span, hands, 1 / actor.subject.amplitude)
    actor.pose(start + 0.7 * span, {"head_twist": 0.8 * look})
    actor.pose(start + span, {"spine_pitch": pitch - 2.0, "head_twist": 0.0, "spine_twist": 0.0})
    actor.time = start + span


def stand_up(actor: Actor) -> None:
    """Rise from the chair: swing the trunk forward over the feet, extend, settle."""
    start, span = actor.time, actor.seconds(1.25, 1.6)
    actor.score.hold(start)
    middle = actor.between_feet()
    seat = actor.score.last("height") - actor.standing
    bend = actor.uniform(0.85, 1.15)
    behind = float((actor.place - middle) @ np.array(ground(np.zeros(2), actor.heading, 1.0, 0.0)))
    actor.pose(start + 0.36 * span, {"pelvis_pitch": 30.0 * bend, "spine_pitch": 30.0 * bend, "head_pitch": -2.0})
    actor.pose(start + 0.34 * span, {"strong_flex": 62.0, "strong_elbow": 34.0, "weak_flex": 58.0, "weak_elbow": 36.0})
    actor.move(start + 0.26 * span, middle, forward=0.94 * behind, height=seat)
    actor.move(start + 0.52 * span, middle, forward=0.42 * behind, height=0.74 * seat)
    actor.pose(start + 0.60 * span, {"pelvis_pitch": 26.0 * bend, "spine_pitch": 20.0 * bend})
    for arm in ("strong", "weak"):
        actor.pose(
            start + 0.62 * span,
            {f"{arm}_flex": 44.0, f"{arm}_elbow": 26.0, f"{arm}_abduct": 10.0, f"{arm}_rotate": 8.0},
        )
    actor.move(start + 0.90 * span, middle, forward=0.012, height=-0.006)
    for side in ("left", "right"):
        actor.score.key(start + 0.3 * span, f"{side}_foot_knee", actor.score.last(f"{side}_foot_knee"))
        actor.score.key(start + 0.9 * span, f"{side}_foot_knee", 4.0)
    actor.time = start + span
    actor.relax(actor.time + 0.1)
    actor.move(actor.time + 0.1, middle)
