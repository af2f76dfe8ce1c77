"""Arms that meet the own body, or stretch away from it: touch a body part, cross limbs, stretch."""

from __future__ import annotations

from motiongen.data.sources.builtin.actions.footwork import step
from motiongen.data.sources.builtin.actor import Actor
from motiongen.data.sources.builtin.reach import before, hand, landmark, planned, side_of
from motiongen.motion.skeleton import JOINT

_TOUCHED = {
    "cheek": ((0.6, 0.5), {"head_pitch": 6.0, "head_roll": 4.0}),
    "crown": ((1.2, 0.4), {"head_pitch": 8.0}),
    "nape": ((1.2, 0.8), {"head_pitch": 16.0}),
    "chest": ((0.8, -0.1), {}),
    "belly": ((0.9, -0.4), {"head_pitch": 14.0}),
    "hip": ((1.0, -0.9), {}),
    "other shoulder": ((0.4, 0.6), {"head_twist": 12.0}),
}
"""Where a palm goes, where the elbow points then, and how trunk and head help."""

_STRETCHED: dict[str, tuple[dict[str, float], dict[str, float], tuple[str, ...]]] = {
    "overhead": (
        {"spine_pitch": -13.0, "pelvis_pitch": -4.0, "head_pitch": -22.0}, {"spine_roll": 7.0}, ("strong", "weak"),
    ),
    "side": ({"spine_roll": -25.0, "pelvis_roll": 4.0, "head_roll": -8.0}, {"spine_roll": -30.0}, ("strong",)),
    "spread": (
        {"spine_pitch": -15.0, "pelvis_pitch": -3.0, "head_pitch": -14.0}, {"spine_twist": 6.0}, ("strong", "weak"),
    ),
}  # fmt: skip
"""How trunk and head stretch, how they sway then, and which arms take part."""


def touch_body_part(actor: Actor) -> None:
    """Put one hand, or both on the same place of both sides, on head, trunk or hips; rub or rest; let go."""
    actor.begin()
    place = str(actor.generator.choice(list(_TOUCHED)))
    both = actor.chance(0.7 if place == "hip" else 0.2) and place not in ("other shoulder", "chest", "belly")
    arrive = actor.time + actor.seconds(0.6, 0.8)
    actor.move(arrive, actor.between_feet(actor.uniform(-0.3, 0.3)), height=-0.005)
    end = _touch(actor, place, ("strong", "weak") if both else ("strong",), arrive, arrive + actor.seconds(0.7, 1.4))
    actor.time = end + actor.seconds(0.5, 0.65)
    actor.move(actor.time, actor.between_feet())
    actor.relax(actor.time)


def step_and_touch_body_part(actor: Actor) -> None:
    """A step while a hand is on head, trunk or hip."""
    start = actor.time
    step(actor)
    end = actor.time
    place = str(actor.generator.choice(list(_TOUCHED)))
    roles = ("strong", "weak") if place == "hip" else ("strong",)
    arrive = start + min(actor.seconds(0.5, 0.65), 0.45 * (end - start))
    released = _touch(actor, place, roles, arrive, end + 0.05)
    actor.time = released + actor.seconds(0.4, 0.5)
    actor.score.hold(released)
    actor.relax(actor.time + 0.1)


def crossing_limbs(actor: Actor) -> None:
    """Fold the arms before the chest, or cross the wrists before the belly, keep them so, let them fall."""
    actor.begin()
    start, folded = actor.time, actor.chance(0.7)
    arrive, leave = start + actor.seconds(0.75, 0.95), actor.seconds(0.9, 1.6)
    actor.pose(arrive, {"spine_pitch": actor.subject.slouch - 2.0 if folded else actor.subject.slouch + 3.0})
    actor.move(arrive, actor.between_feet(actor.uniform(-0.4, 0.4)), height=-0.006)
    chest = actor.standing - actor.floor
    places = {
        "strong": (-0.13, chest + 0.24, 0.235) if folded else (-0.12, chest + 0.01, 0.29),
        "weak": (-0.11, chest + 0.17, 0.17) if folded else (-0.11, chest - 0.02, 0.22),
    }
    for role, (out, up, forward) in places.items():
        # Elbows go out first, so that the forearms do not pass through each other.
        hand(
            actor, start + 0.6 * (arrive - start), role, before(actor, role, out + 0.22, up, forward + 0.08), (0.9, 0.2)
        )
        hand(actor, arrive, role, before(actor, role, out, up, forward), (0.7, 0.1))
    actor.score.hold(arrive + leave)
    release = arrive + leave + actor.seconds(0.55, 0.7)
    for role, (out, up, forward) in places.items():
        opened = before(actor, role, out + 0.24, up - 0.02, forward + 0.08)
        hand(actor, arrive + leave + 0.4 * (release - arrive - leave), role, opened, (0.9, 0.2))
    actor.time = release
    actor.move(actor.time, actor.between_feet())
    actor.relax(actor.time + 0.05)


def stretch(actor: Actor) -> None:
    """Arms overhead and an arched back, a bend to the side below a raised arm, or arms spread and the chest out."""
    actor.begin()
    actor.square_up()
    kind = str(actor.generator.choice(list(_STRETCHED), p=[0.45, 0.30, 0.25]))
    up, stay = actor.time + actor.seconds(0.95, 1.2), actor.seconds(0.8, 1.3)
    side = 1.0 if actor.chance(0.5) else -1.0
    trunk, sway, roles = _STRETCHED[kind]
    actor.pose(up, trunk)
    actor.move(up, actor.between_feet(-0.5 if kind == "side" else 0.0), forward=0.015, height=-0.004)
    high = float(planned(actor).joints[JOINT["head"], 2]) - actor.floor
    for role in roles:
        if kind == "spread":
            pose = {"flex": -22.0, "abduct": 86.0, "elbow": 26.0, "rotate": -40.0, "shrug": 6.0, "reach": -16.0}
            actor.pose(up, {f"{role}_{name}": value for name, value in pose.items()}, 1 / actor.subject.amplitude)
            continue
        # Before the body on the way up, as in a wave the arms would go through the side.
        halfway = actor.time + 0.5 * (up - actor.time)
        hand(actor, halfway, role, before(actor, role, 0.10, high - 0.30, 0.42), (0.8, 0.2))
        actor.score.key(up, f"{side_of(actor, role)}_shrug", 10.0)
        over = before(actor, role, 0.10 if kind == "overhead" else -0.16, high + actor.uniform(0.42, 0.46), 0.04)
        hand(actor, up, role, over, (1.2, 0.5))
    if kind == "side":
        # It hangs free of the leg that the trunk leans over.
        actor.pose(up, {"weak_abduct": 34.0, "weak_flex": 6.0, "weak_elbow": 30.0})
    actor.pose(up + 0.6 * stay, {name: value * side if kind != "side" else value for name, value in sway.items()})
    leave = up + stay
    actor.score.hold(leave)
    actor.time = leave + actor.seconds(0.75, 0.95)
    for role in roles if kind != "spread" else ():
        actor.pose(
            leave + 0.5 * (actor.time - leave), {f"{role}_flex": 70.0, f"{role}_abduct": 22.0, f"{role}_elbow": 45.0}
        )
    actor.move(actor.time, actor.between_feet())
    actor.relax(actor.time + 0.1)


def _touch(actor: Actor, place: str, roles: tuple[str, ...], arrive: float, leave: float) -> float:
    """Key the palms on a place of the body from `arrive` to `leave`, rubbing it at times; the time of leaving."""
    elbow, help_ = _TOUCHED[place]
    actor.pose(arrive, help_)
    rub = actor.chance(0.5)
    for role in roles:
        if place != "hip":
            # The hand comes from the front, not through the body.
            side = side_of(actor, role)
            for name, value in (("flex", 35.0), ("elbow", 80.0), ("abduct", 22.0)):
                actor.score.key(arrive - 0.28, f"{side}_{name}", value)
        hand(actor, arrive, role, landmark(actor, role, place), elbow)
        time, beat = arrive, actor.seconds(0.2, 0.26)
        while rub and time + 2 * beat < leave:
            for amount in (0.035, 0.0):
                time += beat
                point = landmark(actor, role, place)
                point[2] -= amount
                hand(actor, time, role, point, elbow)
        hand(actor, leave, role, landmark(actor, role, place), elbow)
    for name in help_:
        actor.score.key(leave, name, actor.score.last(name))
    return leave
