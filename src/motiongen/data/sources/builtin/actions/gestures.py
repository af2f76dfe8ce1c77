"""Arms and a leg with intent: wave, throw, punch, kick."""

from __future__ import annotations

import numpy as np

from motiongen.data.sources.builtin.actor import Actor, ground


def wave_hand(actor: Actor) -> None:
    """Raise the strong hand, sway it from the elbow, lower it. Large beside the head, or small before the chest."""
    actor.begin()
    start = actor.time
    small = actor.chance(0.35)
    high = 0.0 if small else actor.uniform(0.0, 1.0)
    raised = {
        "strong_flex": 38.0 if small else 22.0 + 6.0 * high,
        "strong_abduct": 22.0 if small else 72.0 + 48.0 * high,
        "strong_rotate": -38.0 if small else -80.0 + 6.0 * high,
        "strong_elbow": 112.0 if small else 92.0 - 42.0 * high,
        "strong_shrug": 2.0 if small else 6.0,
    }
    trunk = {"spine_roll": -3.0, "spine_twist": -4.0, "head_roll": 5.0, "head_twist": 3.0, "head_pitch": -2.0}
    actor.move(start + 0.5, actor.between_feet(-0.3), height=-0.004)
    # The elbow leads the hand up.
    lift = actor.seconds(0.48, 0.62)
    anticipation = {"strong_flex": 12.0, "strong_abduct": 16.0, "strong_elbow": 40.0, "strong_rotate": 20.0}
    actor.pose(start + 0.45 * lift, anticipation)
    actor.pose(start + lift, raised)
    actor.pose(start + lift + 0.05, trunk)
    beat = actor.seconds(0.17, 0.23)
    time, width = start + lift, actor.uniform(0.8, 1.15) * (0.8 if small else 1.0)
    for swing in range(2 * actor.generator.integers(2, 5)):
        out = 1.0 if swing % 2 == 0 else -1.0
        fade = 1.0 if swing else 0.6
        time += beat * actor.uniform(0.93, 1.07)
        actor.pose(
            time,
            {
                "strong_rotate": raised["strong_rotate"] - (24.0 - 14.0 * high) * out * width * fade,
                "strong_elbow": raised["strong_elbow"] - (13.0 + 10.0 * high) * out * width * fade,
                "strong_abduct": raised["strong_abduct"] + 3.0 * out * width,
                "strong_flex": raised["strong_flex"],
                "strong_shrug": raised["strong_shrug"],
            },
        )
        actor.pose(time + 0.4 * beat, {"strong_wrist": 16.0 * out * width})
    lower = actor.seconds(0.55, 0.7)
    actor.pose(
        time + 0.45 * lower, {"strong_flex": 20.0, "strong_abduct": 30.0, "strong_elbow": 62.0, "strong_rotate": 5.0}
    )
    actor.move(time + lower, actor.between_feet())
    actor.relax(time + lower)
    actor.time = time + 0.92 * lower


def throw(actor: Actor) -> None:
    """Wind up over the strong leg, step in with the weak one, release and follow through; overarm or underarm."""
    actor.begin()
    actor.square_up()
    start, heading = actor.time, actor.heading
    wind, whip = actor.seconds(0.62, 0.78), actor.seconds(0.30, 0.36)
    under = actor.chance(0.3)
    force = actor.uniform(0.85, 1.1)
    stride = actor.uniform(0.26, 0.42) * actor.subject.stride
    if under:
        cocked = {"strong_flex": -46.0, "strong_abduct": 14.0, "strong_elbow": 22.0, "strong_rotate": 5.0}
        release = {
            "strong_flex": 62.0,
            "strong_abduct": 8.0,
            "strong_elbow": 14.0,
            "strong_rotate": -10.0,
            "strong_wrist": -10.0,
        }
        through = {
            "strong_flex": 104.0,
            "strong_abduct": 2.0,
            "strong_elbow": 38.0,
            "strong_rotate": -5.0,
            "strong_wrist": 8.0,
        }
        bend = {"spine_pitch": 17.0, "pelvis_pitch": 10.0}
    else:
        cocked = {
            "strong_flex": -6.0,
            "strong_abduct": 86.0,
            "strong_elbow": 98.0,
            "strong_rotate": -68.0,
            "strong_shrug": 6.0,
        }
        release = {
            "strong_flex": 86.0,
            "strong_abduct": 42.0,
            "strong_elbow": 34.0,
            "strong_rotate": -30.0,
            "strong_reach": 12.0,
        }
        through = {
            "strong_flex": 44.0,
            "strong_abduct": -14.0,
            "strong_elbow": 26.0,
            "strong_rotate": 28.0,
            "strong_reach": 10.0,
        }
        bend = {"spine_pitch": 20.0, "pelvis_pitch": 9.0}
    gather = {"strong_flex": 24.0, "strong_elbow": 74.0, "strong_abduct": 18.0, "weak_flex": 26.0, "weak_elbow": 60.0}
    actor.pose(start + 0.42 * wind, gather | {"strong_rotate": 18.0}, force)
    actor.pose(start + wind, cocked, force)
    actor.pose(start + wind, {"weak_flex": 62.0, "weak_abduct": 16.0, "weak_elbow": 30.0, "weak_rotate": 20.0}, force)
    actor.pose(
        start + 0.92 * wind,
        {"spine_twist": -26.0, "pelvis_twist": -18.0, "spine_pitch": -4.0, "spine_roll": 6.0, "head_twist": 4.0},
        force,
    )
    support = actor.foot(actor.strong)
    actor.move(start + 0.6 * wind, 0.85 * support + 0.15 * actor.between_feet(), forward=-0.05, height=-0.03)
    landing = np.array(ground(actor.stance(actor.weak, actor.between_feet(), heading), heading, stride, 0.0))
    leave = start + 0.62 * wind
    actor.step(actor.weak, leave, start + wind + 0.12 * whip, landing, heading + actor.toe_out(actor.weak), lift=0.08)
    # Hips, then shoulders, then the arm: each part starts a little later.
    hit = start + wind + whip
    actor.pose(hit - 0.10, {"pelvis_twist": 15.0, **{"pelvis_pitch": 0.6 * bend["pelvis_pitch"]}}, force)
    actor.pose(hit - 0.03, {"spine_twist": 18.0, "spine_pitch": 8.0, "spine_roll": -5.0}, force)
    actor.pose(hit, release, force)
    actor.pose(hit, {"weak_flex": 6.0, "weak_abduct": 20.0, "weak_elbow": 62.0, "weak_rotate": 30.0}, force)
    actor.move(hit, actor.between_feet(-0.45), height=-0.05)
    calm = hit + actor.seconds(0.26, 0.32)
    actor.pose(calm, through, force)
    actor.pose(calm, {"spine_twist": 27.0, "pelvis_twist": 20.0, "spine_roll": -4.0, **bend}, force)
    actor.move(calm + 0.05, actor.between_feet(-0.7), height=-0.05)
    actor.time = calm + 0.12
    _come_up(actor, heading)


def punch(actor: Actor) -> None:
    """Raise the guard, strike one to three times with alternating fists, drop the guard."""
    actor.begin()
    actor.square_up()
    start, heading = actor.time, actor.heading
    guard = {
        "strong_flex": 40.0, "strong_abduct": 14.0, "strong_rotate": 26.0, "strong_elbow": 102.0,
        "weak_flex": 48.0, "weak_abduct": 10.0, "weak_rotate": 24.0, "weak_elbow": 98.0,
        "spine_pitch": 9.0, "spine_twist": -9.0, "pelvis_twist": -12.0, "head_pitch": 8.0,
    }  # fmt: skip
    ready = actor.seconds(0.42, 0.55)
    stride = actor.uniform(0.20, 0.30)
    landing = np.array(ground(actor.stance(actor.weak, actor.between_feet(), heading), heading, stride, 0.0))
    actor.move(start + 0.35 * ready, actor.between_feet(0.7), height=-0.015)
    actor.step(actor.weak, start + 0.25 * ready, start + ready, landing, heading + actor.toe_out(actor.weak))
    actor.pose(start + ready, guard)
    actor.move(start + ready, actor.between_feet(), height=-0.045)
    time = start + ready + 0.05
    blows = int(actor.generator.choice([1, 2, 3], p=[0.3, 0.45, 0.25]))
    fists = ["strong"] if blows == 1 else ["weak", "strong", "weak"][:blows]
    for fist in fists:
        far = fist == "strong"
        other = "weak" if far else "strong"
        turned = 1.0 if far else -0.55
        out, back = actor.seconds(0.29, 0.33), actor.seconds(0.31, 0.37)
        load = actor.seconds(0.10, 0.15)
        # Anticipation: the fist and shoulder draw back before they go.
        actor.pose(time + load, {f"{fist}_flex": 26.0, f"{fist}_elbow": 106.0, f"{fist}_reach": -5.0})
        actor.pose(time + load, {"spine_twist": -16.0 * turned, "pelvis_twist": -14.0 * turned})
        actor.move(time + load, actor.between_feet(0.15 if far else -0.1), height=-0.05)
        hit = time + load + out
        actor.pose(hit - 0.06, {"pelvis_twist": 20.0 * turned, "spine_twist": 18.0 * turned, "spine_pitch": 12.0})
        actor.pose(
            hit,
            {
                f"{fist}_flex": 100.0,
                 f"{fist}_abduct": 27.0 if far else 12.0, f"{fist}_rotate": 45.0, f"{fist}_elbow": 9.0,
                f"{fist}_reach": 17.0, f"{fist}_shrug": 7.0,
                f"{other}_flex": 36.0, f"{other}_elbow": 108.0, f"{other}_abduct": 12.0, f"{other}_rotate": 28.0,
            },
        )  # fmt: skip
        actor.move(hit, actor.between_feet(-0.5 if far else -0.3), height=-0.06)
        actor.pose(hit + 0.05, {f"{fist}_elbow": 12.0, f"{fist}_flex": 98.0, "spine_twist": 21.0 * turned})
        time = hit + 0.05 + back
        recoil = {name: value for name, value in guard.items() if fist in name}
        actor.pose(time, recoil | {f"{fist}_reach": 0.0, f"{fist}_shrug": 0.0})
        actor.pose(time + 0.03, {name: guard[name] for name in ("spine_twist", "pelvis_twist", "spine_pitch")})
        actor.move(time, actor.between_feet(-0.1), height=-0.045)
    actor.time = time
    _come_up(actor, heading)


def kick(actor: Actor) -> None:
    """A front kick with the strong leg: load the other leg, lift the knee, snap, recoil, set down."""
    actor.begin()
    actor.square_up()
    start, heading, score = actor.time, actor.heading, actor.score
    height = actor.uniform(0.48, 0.84) * min(actor.subject.amplitude, 1.1)
    load, chamber = actor.seconds(0.34, 0.44), actor.seconds(0.28, 0.34)
    snap, recoil, down = actor.seconds(0.23, 0.28), actor.seconds(0.24, 0.30), actor.seconds(0.34, 0.42)
    foot, side = f"{actor.strong}_foot_", actor.outward(actor.strong)
    home, support = actor.foot(actor.strong), actor.foot(actor.weak)
    beside = np.array(ground(support, heading, 0.0, 2 * side * actor.subject.stance_width))
    lean = 0.6 + 0.6 * height

    def place(time: float, forward: float, inward: float, lift: float, pitch: float) -> None:
        x, y = ground(beside, heading, forward, -side * inward)
        for name, value in (("x", x), ("y", y), ("lift", lift), ("pitch", pitch)):
            score.key(time, foot + name, value)

    # Anticipation: the weight goes over the standing leg, the kicking foot rolls onto its ball, the arms counter.
    actor.move(start + load, 0.92 * support + 0.08 * home, height=-0.025)
    actor.pose(start + load, {"spine_pitch": 8.0, "spine_twist": 6.0, "pelvis_roll": 2.0, "pelvis_twist": -6.0})
    actor.pose(start + load, {"strong_flex": 18.0, "strong_elbow": 50.0, "weak_flex": 8.0, "weak_elbow": 45.0})
    leave = start + 0.75 * load
    for time, pitch in ((leave - 0.30 * load, 0.0), (leave, -24.0)):
        for name, value in (("x", home[0]), ("y", home[1]), ("lift", 0.0), ("pitch", pitch)):
            score.key(time, foot + name, value)
    lifted = start + load + chamber
    place(0.55 * lifted + 0.45 * leave, 0.02, 0.01, 0.16 + 0.1 * height, -38.0)
    place(lifted, 0.20, 0.03, 0.24 + 0.42 * height, -26.0)
    actor.move(lifted, support, forward=0.01, height=-0.02)
    actor.pose(lifted, {"pelvis_pitch": -8.0 * lean, "spine_pitch": 14.0, "pelvis_twist": 4.0, "spine_twist": -8.0})
    actor.pose(lifted, {"strong_flex": -8.0, "strong_abduct": 24.0, "strong_elbow": 62.0})
    actor.pose(lifted, {"weak_flex": 34.0, "weak_abduct": 22.0, "weak_elbow": 84.0, "weak_rotate": 22.0})
    hit = lifted + snap
    # The leg ends almost straight: the foot is put at 96 % of its length from the hip.
    body = actor.subject.body
    below = actor.standing + body.bone("hip")[1] - body.ankle_height - height
    ahead = np.sqrt((0.96 * body.leg_length) ** 2 - below**2)
    place(hit, 0.02 + ahead, 0.05, height, -6.0)
    place(hit + 0.07, 0.01 + ahead, 0.05, height - 0.01, -8.0)
    actor.move(hit, support, forward=0.05, height=-0.012)
    actor.pose(hit, {"pelvis_pitch": -20.0 * lean, "spine_pitch": 5.0, "pelvis_twist": 13.0, "spine_twist": -18.0})
    actor.pose(hit, {"strong_flex": -26.0, "strong_abduct": 32.0, "strong_elbow": 44.0})
    actor.pose(hit, {"weak_flex": 46.0, "weak_abduct": 20.0, "weak_elbow": 74.0})
    back = hit + 0.07 + recoil
    place(back, 0.16, 0.03, 0.16 + 0.36 * height, -32.0)
    actor.move(back, 0.95 * support + 0.05 * home, height=-0.025)
    actor.pose(back, {"pelvis_pitch": -4.0 * lean, "spine_pitch": 13.0, "pelvis_twist": 2.0, "spine_twist": -4.0})
    actor.pose(
        back, {"strong_flex": 4.0, "strong_abduct": 18.0, "strong_elbow": 50.0, "weak_flex": 22.0, "weak_elbow": 55.0}
    )
    landed = back + down
    forward = actor.uniform(0.0, 0.30) if actor.chance(0.5) else 0.0
    place(0.4 * back + 0.6 * landed, 0.4 * forward + 0.05, 0.01, 0.09, -14.0)
    place(landed, forward, 0.0, 0.0, 0.0)
    actor.move(landed + 0.10, actor.between_feet(0.15), height=-0.035)
    actor.pose(
        landed + 0.10, {"spine_pitch": actor.idle["spine_pitch"] + 4.0, "pelvis_pitch": 2.0, "pelvis_twist": 0.0}
    )
    actor.time = landed + 0.10
    _come_up(actor, heading)


def _come_up(actor: Actor, heading: float) -> None:
    """Back to rest: the rear foot steps up where the stance is long; arms and trunk settle into the next action."""
    start = actor.time
    rear = actor.rear()
    gap = np.linalg.norm(actor.foot("left") - actor.foot("right"))
    span = actor.seconds(0.46, 0.58)
    actor.relax(start + span + 0.12)
    if gap > 0.3 and actor.chance(0.7):
        other = "left" if rear == "right" else "right"
        across = 2 * actor.outward(rear) * actor.subject.stance_width
        target = np.array(ground(actor.foot(other), heading, 0.0, across))
        actor.move(start + 0.45 * span, 0.8 * actor.foot(other) + 0.2 * actor.between_feet(), height=-0.02)
        actor.step(rear, start + 0.35 * span, start + 1.25 * span, target, heading + actor.toe_out(rear))
        span *= 1.3
    actor.time = start + span
    actor.move(actor.time, actor.between_feet())
