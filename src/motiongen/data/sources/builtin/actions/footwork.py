"""Steps and turns: the feet carry the body to another place or heading."""

from __future__ import annotations

import numpy as np

from motiongen.data.sources.builtin.actor import Actor, ground


def turn(actor: Actor) -> None:
    """Turn in place by 60 to 180 degrees: the head leads, the inner foot opens, the other follows."""
    actor.begin()
    start, origin, heading = actor.time, actor.between_feet(), actor.heading
    angle = actor.uniform(60.0, 180.0) * (1.0 if actor.chance(0.5) else -1.0)
    inner, outer = ("left", "right") if angle > 0 else ("right", "left")
    sign = float(np.sign(angle))
    rounds = 1 if abs(angle) < 85 else 2 if abs(angle) < 150 else 3
    beat = actor.seconds(0.36, 0.44)
    score = actor.score
    look = sign * min(38.0, 0.4 * abs(angle))
    gaze = {"head_twist": look, "head_pitch": actor.subject.chin + 4}
    now = start + 0.30 * beat
    for name, value in gaze.items():
        score.key(start + 0.8 * beat, name, value)
    score.key(start + 0.9 * beat, "spine_twist", 0.30 * look)
    for index in range(rounds):
        for side, share in ((inner, index + 0.75), (outer, index + 1.0)):
            last = index == rounds - 1 and side == outer
            aim = heading + angle * (1.0 if index == rounds - 1 else share / rounds)
            support = actor.foot(outer if side == inner else inner)
            score.key(now + 0.15 * beat, "x", 0.45 * origin[0] + 0.55 * support[0])
            score.key(now + 0.15 * beat, "y", 0.45 * origin[1] + 0.55 * support[1])
            score.key(now + 0.15 * beat, "height", actor.standing - 0.012)
            actor.step(
                side, now, now + beat, actor.stance(side, origin, aim), aim + actor.toe_out(side), lift=0.045, heel=20.0
            )
            now += 0.92 * beat
            turned = angle * (index + (0.55 if side == inner else 1.0)) / rounds
            score.key(now + (0.1 * beat if not last else 0.25 * beat), "heading", heading + turned)
            score.key(now, "height", actor.standing - 0.004)
    for side in ("left", "right"):
        away = 9.0 if side == inner else 5.0
        score.key(start + 1.2 * beat, f"{side}_abduct", actor.idle[f"{side}_abduct"] + away)
        score.key(start + 1.2 * beat, f"{side}_flex", actor.idle[f"{side}_flex"] + (8.0 if side == outer else -8.0))
    end = now + 0.35 * beat
    score.key(max(now - 1.0 * beat, start + 1.3 * beat), "head_twist", 0.5 * look)
    for name in ("head_twist", "head_pitch", "spine_twist"):
        score.key(end, name, actor.idle[name])
    for side in ("left", "right"):
        for name in ("abduct", "flex"):
            score.key(end + 0.2, f"{side}_{name}", actor.idle[f"{side}_{name}"])
    score.key(end, "x", origin[0])
    score.key(end, "y", origin[1])
    score.key(end, "height", actor.standing)
    actor.time = end


def step(actor: Actor) -> None:
    """One step forward, back or to a side; the other foot follows most of the time."""
    actor.begin()
    actor.square_up(0.22)
    start, origin, heading = actor.time, actor.between_feet(), actor.heading
    direction = actor.generator.choice(["forward", "back", "side"], p=[0.45, 0.25, 0.30])
    reach = actor.uniform(0.34, 0.62) * actor.subject.stride * {"forward": 1.0, "back": 0.75, "side": 0.75}[direction]
    lead = actor.strong if actor.chance(0.6) else actor.weak
    follow = "left" if lead == "right" else "right"
    forward, left = {
        "forward": (reach, 0.0),
        "back": (-reach, 0.0),
        "side": (0.0, reach * actor.outward(lead)),
    }[direction]
    goal = np.array(ground(origin, heading, forward, left))
    span, shift = actor.seconds(0.50, 0.62), actor.seconds(0.20, 0.28)
    side = actor.outward(lead)
    lean = {"forward": 5.0, "back": -2.0, "side": 1.0}[direction]
    score = actor.score

    # Weight goes to the other leg and a little against the direction, then the body falls into the step.
    actor.move(start + shift, 0.7 * actor.foot(follow) + 0.3 * origin, forward=-0.03 * np.sign(forward), height=-0.012)
    score.key(start + shift, "pelvis_roll", -2.0 * side)
    actor.step(
        lead, start + shift, start + shift + span, actor.stance(lead, goal, heading), heading + actor.toe_out(lead)
    )
    score.key(start + shift + 0.4 * span, "pelvis_pitch", 0.6 * lean)
    score.key(start + shift + 0.5 * span, "spine_pitch", actor.idle["spine_pitch"] + 0.5 * lean)
    score.key(start + shift + 0.8 * span, "pelvis_twist", -side * np.sign(forward) * 9.0)
    score.key(start + shift + 0.9 * span, "spine_twist", side * np.sign(forward) * 13.0)
    _swing_arms(actor, lead, start + shift + 0.9 * span, 16.0 * np.sign(forward), 5.0)
    both = actor.chance(0.75)
    landed = start + shift + span
    if not both:
        actor.move(landed + 0.10, actor.between_feet(0.25 if lead == actor.strong else -0.25), height=-0.02)
        actor.time = landed + actor.seconds(0.30, 0.4)
        actor.move(actor.time, actor.between_feet())
        actor.relax(actor.time + 0.25)
        return
    actor.move(landed, 0.5 * actor.foot(lead) + 0.5 * actor.foot(follow), height=-0.018)
    actor.move(landed + 0.24, 0.75 * actor.foot(lead) + 0.25 * goal, height=-0.012)
    score.key(landed + 0.15, "pelvis_roll", 2.0 * side)
    score.key(landed + 0.35, "pelvis_twist", 0.0)
    # The second foot leaves a little after the first has landed and arrives beside it.
    leave = landed + 0.14
    actor.step(follow, leave, leave + 0.9 * span, actor.stance(follow, goal, heading), heading + actor.toe_out(follow))
    _swing_arms(actor, follow, leave + 0.75 * span, 6.0 * np.sign(forward), 2.0)
    actor.time = leave + 0.9 * span + actor.seconds(0.10, 0.2)
    actor.move(actor.time, goal)
    actor.relax(actor.time + 0.2)


def _swing_arms(actor: Actor, lead: str, time: float, swing: float, away: float) -> None:
    """The arm of the standing leg goes forward, the other back."""
    for arm in ("left", "right"):
        forward = swing * (-0.7 if arm == lead else 1.0) * actor.subject.amplitude
        actor.score.key(time, f"{arm}_flex", actor.idle[f"{arm}_flex"] + forward)
        actor.score.key(time, f"{arm}_elbow", actor.idle[f"{arm}_elbow"] + 0.7 * abs(forward))
        actor.score.key(time, f"{arm}_abduct", actor.idle[f"{arm}_abduct"] + away)
