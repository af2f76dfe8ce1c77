"""Hands that reach for a place: inverse kinematics of an arm, and places on and before a body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from motiongen.data.sources.builtin.actor import Actor, ground
from motiongen.data.sources.builtin.curves import Array, ease
from motiongen.data.sources.builtin.ik import solve, turn
from motiongen.data.sources.builtin.score import CHANNELS
from motiongen.motion.kinematics import forward_kinematics
from motiongen.motion.skeleton import JOINT

PALM = 0.085
"""The middle of the palm from the wrist, metres."""
LANDMARKS = {
    "mouth": ("head", 0.015, 0.035, 0.155),
    "cheek": ("head", 0.085, 0.045, 0.105),
    "crown": ("head", 0.045, 0.195, 0.045),
    "ear": ("head", 0.120, 0.075, 0.020),
    "nape": ("neck", 0.050, 0.065, -0.090),
    "chest": ("spine3", -0.040, 0.050, 0.165),
    "belly": ("spine1", 0.020, 0.000, 0.170),
    "hip": ("pelvis", 0.185, 0.060, 0.040),
    "other shoulder": ("spine3", -0.155, 0.120, 0.130),
    "other elbow": ("spine3", -0.160, -0.070, 0.165),
}
"""Places that a palm touches: a joint, and metres from it in its axes, outward on the hand's side, up, forward."""


@dataclass(frozen=True)
class Pose:
    """A body in SMPL's axes: x to the left of a person who faces -y of the world, y up."""

    rotations: Array
    """(22, 3, 3)"""
    joints: Array
    """(22, 3) metres"""


def side_of(actor: Actor, role: str) -> str:
    """`left` or `right` for `strong` or `weak`."""
    return {"strong": actor.strong, "weak": actor.weak}[role]


def planned(actor: Actor) -> Pose:
    """The body as the keys that are last in time have it."""
    body = actor.subject.body
    local, position = solve({channel: np.array([actor.score.last(channel)]) for channel in CHANNELS}, body)
    world, joints = forward_kinematics(torch.from_numpy(local[0]), torch.from_numpy(position[0]), body.skeleton())
    return Pose(world.numpy(), joints.numpy())


def before(actor: Actor, role: str, out: float, up: float, forward: float) -> Array:
    """A place (3,) in the world by its metres from the pelvis' place on the floor, outward on the side of an arm."""
    side = side_of(actor, role)
    x, y = ground(actor.place, actor.heading, forward, actor.outward(side) * out)
    return np.array([x, y, actor.floor + up])


def landmark(actor: Actor, role: str, name: str) -> Array:
    """A place (3,) in the world on the planned body, see `LANDMARKS`."""
    joint, out, up, forward = LANDMARKS[name]
    pose, offset = planned(actor), np.array([actor.outward(side_of(actor, role)) * out, up, forward])
    offset *= actor.subject.body.stature
    place: Array = pose.joints[JOINT[joint]] + pose.rotations[JOINT[joint]] @ offset
    return place


def hand(actor: Actor, time: float, role: str, place: Array, elbow: tuple[float, float] = (0.45, -0.25)) -> None:
    """Key an arm so that its palm is at a place (3,) of the world, on the body as it is planned so far.

    A place out of reach is reached for. Trunk and pelvis have to be keyed first.

    Args:
        actor: whose arm.
        time: seconds.
        role: `strong` or `weak`.
        place: metres.
        elbow: where it points, outward and forward for one part downward.
    """
    side = side_of(actor, role)
    mirror = actor.outward(side)
    pose, body = planned(actor), actor.subject.body
    offsets = body.skeleton().offsets.numpy().astype(float)
    bones = (float(np.linalg.norm(body.bone("elbow"))), float(np.linalg.norm(body.bone("wrist"))) + PALM)
    chest = pose.rotations[JOINT["spine3"]].T
    target = chest @ (place - pose.joints[JOINT["spine3"]])
    pole = np.array([mirror * elbow[0], -1.0, elbow[1]])
    reach, lift = actor.score.last(f"{side}_reach"), 0.0
    for _ in range(6):
        collar = turn("y", np.array(-mirror * reach)) @ turn("z", np.array(mirror * lift))
        shoulder = offsets[JOINT[f"{side}_collar"]] + collar @ offsets[JOINT[f"{side}_shoulder"]]
        upper, lower, bend = _two_bones(bones, collar.T @ (target - shoulder), collar.T @ pole)
        flex = np.arctan2(upper[2], -upper[1])
        away = np.arcsin(np.clip(mirror * upper[0], -1.0, 1.0))
        abduct = np.rad2deg(away) + lift
        raised = np.rad2deg(np.arccos(np.clip(np.cos(flex) * np.cos(np.deg2rad(abduct)), -1.0, 1.0)))
        lift = float(22.0 * ease(raised, 30.0, 170.0)) + actor.score.last(f"{side}_shrug")
    hanging = turn("z", np.array(-mirror * np.rad2deg(away))) @ turn("x", np.array(np.rad2deg(flex))) @ lower
    rotate = np.rad2deg(np.arctan2(-mirror * hanging[0], hanging[2]))
    values = {"flex": np.rad2deg(flex), "abduct": abduct, "rotate": rotate, "elbow": np.clip(bend, 4.0, 140.0)}
    for name, value in values.items():
        actor.score.key(time, f"{side}_{name}", float(value))


def _two_bones(bones: tuple[float, float], target: Array, pole: Array) -> tuple[Array, Array, float]:
    """Directions (3,) of upper arm and forearm that reach from the shoulder to a target, and the elbow's degrees."""
    above, below = bones
    length = float(np.linalg.norm(target))
    line = target / length
    length = float(np.clip(length, abs(above - below) + 0.06, 0.995 * (above + below)))
    across = pole - (pole @ line) * line
    across /= np.linalg.norm(across)
    cosine = (above**2 + length**2 - below**2) / (2 * above * length)
    upper = cosine * line + np.sqrt(max(1 - cosine**2, 0.0)) * across
    lower = (length * line - above * upper) / below
    bend = np.arccos(np.clip((length**2 - above**2 - below**2) / (2 * above * below), -1.0, 1.0))
    return upper, lower, float(np.rad2deg(bend))
