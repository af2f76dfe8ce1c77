"""Channels to rotations: trunk and arms directly, legs by two-bone inverse kinematics from planned feet."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from motiongen.data.sources.builtin.body import Body
from motiongen.data.sources.builtin.curves import Array, ease, smooth
from motiongen.motion.skeleton import JOINT, JOINTS

Curves = Mapping[str, Array]
TO_WORLD = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""SMPL's axes (x left, y up, z forward) to a person who faces -y in a world with z up."""
_SPINE = {"spine1": 0.28, "spine2": 0.34, "spine3": 0.38}
"""Share of the spine's bend that each joint takes."""
FULL_REACH = 0.996
"""Share of a leg's length at which a standing leg counts as straight."""
SHORTEST_LEG = 0.37
"""Share of a leg's length between hip and ankle when the knee is fully bent, about 137 degrees."""


def turn(axis: str, degrees: Array) -> Array:
    """Rotations (T, 3, 3) about x, y or z of SMPL's axes."""
    angle = np.deg2rad(degrees)
    cos, sin, zero, one = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    rows = {
        "x": [one, zero, zero, zero, cos, -sin, zero, sin, cos],
        "y": [cos, zero, sin, zero, one, zero, -sin, zero, cos],
        "z": [cos, -sin, zero, sin, cos, zero, zero, zero, one],
    }[axis]
    return np.stack(rows, axis=-1).reshape(*angle.shape, 3, 3)


def solve(curves: Curves, body: Body) -> tuple[Array, Array]:
    """Pose the body at every frame.

    Args:
        curves: every channel of a score, (T,) each.
        body: whose.

    Returns:
        Local rotations (T, 22, 3, 3) and world positions of the pelvis (T, 3), metres.
    """
    frames = len(curves["x"])
    rotations = np.tile(np.eye(3), (frames, JOINTS, 1, 1))
    pelvis = turn("y", curves["heading"] + curves["pelvis_twist"]) @ turn("x", curves["pelvis_pitch"])
    pelvis = pelvis @ turn("z", curves["pelvis_roll"])
    rotations[:, 0] = TO_WORLD @ pelvis
    _trunk(rotations, curves)
    for side in ("left", "right"):
        _arm(rotations, curves, side)
    position = np.stack([curves["x"], curves["height"], -curves["y"]], axis=-1)
    feet = {}
    sink = np.zeros(frames)
    for side in ("left", "right"):
        hip = _hip(pelvis, position, side, body)
        feet[side] = _foot(curves, side, np.zeros(frames), body)
        missing = _missing_reach(hip, feet[side][0], curves[f"{side}_foot_lift"], body)
        # A leg that is too short for its stance first lifts the heel; the pelvis sinks for what is still missing.
        heel = smooth(_widened(np.minimum(missing, 0.09)), 2.0)
        feet[side] = _foot(curves, side, -np.rad2deg(np.arcsin(heel / body.ball[0])), body)
        sink = np.maximum(sink, _missing_reach(hip, feet[side][0], curves[f"{side}_foot_lift"], body))
    position[:, 1] -= smooth(_widened(sink), 2.0)
    for side in ("left", "right"):
        _leg(rotations, pelvis, position, curves, side, *feet[side], body)
    return rotations, position @ TO_WORLD.T


def _trunk(rotations: Array, curves: Curves) -> None:
    for name, share in _SPINE.items():
        bend = turn("y", share * curves["spine_twist"]) @ turn("x", share * curves["spine_pitch"])
        rotations[:, JOINT[name]] = bend @ turn("z", share * curves["spine_roll"])
    # The eyes stay on their target while the trunk turns below them.
    twist = curves["head_twist"] - 0.85 * (curves["pelvis_twist"] + curves["spine_twist"])
    pitch = curves["head_pitch"] - 0.75 * (curves["pelvis_pitch"] + curves["spine_pitch"])
    roll = curves["head_roll"] - 0.6 * (curves["pelvis_roll"] + curves["spine_roll"])
    for name, share in (("neck", 0.45), ("head", 0.55)):
        nod = turn("y", share * twist) @ turn("x", share * pitch)
        rotations[:, JOINT[name]] = nod @ turn("z", share * roll)


def _arm(rotations: Array, curves: Curves, side: str) -> None:
    """Shoulder, elbow and wrist; the collar bone follows a raised arm (scapulohumeral rhythm)."""
    mirror = 1.0 if side == "left" else -1.0
    flex, abduct, rotate, elbow, wrist, shrug, reach = (
        curves[f"{side}_{name}"] for name in ("flex", "abduct", "rotate", "elbow", "wrist", "shrug", "reach")
    )
    down = np.cos(np.deg2rad(flex)) * np.cos(np.deg2rad(abduct))
    raised = np.rad2deg(np.arccos(np.clip(down, -1.0, 1.0)))
    lift = shrug + 22.0 * ease(raised, 30.0, 170.0)
    rotations[:, JOINT[f"{side}_collar"]] = turn("y", -mirror * reach) @ turn("z", mirror * lift)
    hang = turn("z", np.full_like(flex, -mirror * 90.0))
    swing = turn("x", -flex) @ turn("z", mirror * (abduct - lift)) @ turn("y", -mirror * rotate)
    rotations[:, JOINT[f"{side}_shoulder"]] = swing @ hang
    rotations[:, JOINT[f"{side}_elbow"]] = turn("y", -mirror * np.clip(elbow, 1.0, 145.0))
    rotations[:, JOINT[f"{side}_wrist"]] = turn("z", mirror * wrist)


def _foot(curves: Curves, side: str, heel: Array, body: Body) -> tuple[Array, Array, Array]:
    """Ankle positions (T, 3) in SMPL's axes, rotations of the foot (T, 3, 3), bend of the toes (T,) in degrees.

    A foot with its toes up turns about the heel, one with its heel up about the ball, which stays where it is. The
    degrees of `heel` (T,) come on top of the planned pitch.
    """
    x, y, yaw, pitch = (curves[f"{side}_foot_{name}"] for name in ("x", "y", "yaw", "pitch"))
    lift, floor = curves[f"{side}_foot_lift"], curves[f"{side}_foot_ground"]
    pitch = np.maximum(pitch + heel, np.minimum(pitch, -60.0))
    angle = np.deg2rad(pitch)
    on_heel = ease(pitch, -8.0, 8.0)
    pivot = on_heel[:, None] * body.heel + (1 - on_heel[:, None]) * body.ball
    cos, sin = np.cos(angle), np.sin(angle)
    forward = pivot[:, 0] * (1 - cos) + pivot[:, 1] * sin - body.midfoot
    up = pivot[:, 1] * (1 - cos) - pivot[:, 0] * sin
    heading = np.deg2rad(yaw)
    height = body.ankle_height + up + lift + floor
    ankle = np.stack([x + forward * np.sin(heading), height, -y + forward * np.cos(heading)], -1)
    toes = np.clip(-pitch, 0.0, 50.0) * (1 - 0.8 * ease(lift, -0.02, 0.22))
    return ankle, turn("y", yaw) @ turn("x", -pitch), toes


def _hip(pelvis: Array, position: Array, side: str, body: Body) -> Array:
    offset = body.bone("hip") * np.array([1.0 if side == "left" else -1.0, 1.0, 1.0])
    hip: Array = position + pelvis @ offset
    return hip


def _missing_reach(hip: Array, ankle: Array, lift: Array, body: Body) -> Array:
    """By how much a hip is too high for its standing foot (T,), metres; zero while the foot is in the air."""
    offset = hip - ankle
    flat = np.linalg.norm(offset[:, [0, 2]], axis=-1)
    highest = np.sqrt(np.maximum((FULL_REACH * body.leg_length) ** 2 - flat**2, 0.3**2))
    missing: Array = (1 - ease(lift, 0.0, 0.03)) * np.maximum(offset[:, 1] - highest, 0.0)
    return missing


def _widened(values: Array) -> Array:
    """The largest value of the seven frames around each, so that smoothing does not fall short of a peak."""
    largest: Array = np.lib.stride_tricks.sliding_window_view(np.pad(values, 3, mode="edge"), 7).max(axis=-1)
    return largest


def _leg(
    rotations: Array,
    pelvis: Array,
    position: Array,
    curves: Curves,
    side: str,
    ankle: Array,
    foot: Array,
    toes: Array,
    body: Body,
) -> None:
    """Two-bone inverse kinematics by the law of cosines; the knee is a hinge that points between hips and toes."""
    hip = _hip(pelvis, position, side, body)
    line = ankle - hip
    distance = np.linalg.norm(line, axis=-1)
    line = line / distance[:, None]
    # Near full length the leg gives way softly, so that the knee does not snap; earlier when the foot is in the air.
    air = ease(curves[f"{side}_foot_lift"], 0.0, 0.08)
    soft, full = (0.99 - 0.08 * air) * body.leg_length, (0.9985 - 0.02 * air) * body.leg_length
    beyond = np.maximum(distance - soft, 0.0)
    distance = np.where(distance > soft, full - (full - soft) * np.exp(-beyond / (full - soft)), distance)
    upper_bone, lower_bone = body.bone("knee"), body.bone("ankle")
    thigh, shank = np.linalg.norm(upper_bone), np.linalg.norm(lower_bone)
    distance = np.maximum(distance, SHORTEST_LEG * body.leg_length)
    inner = np.arccos(np.clip((distance**2 - thigh**2 - shank**2) / (2 * thigh * shank), -1.0, 1.0))
    # The angle between the bones grows with flexion from the small one that the rest pose holds.
    rest = (np.arctan2(lower_bone[2], lower_bone[1]) - np.arctan2(upper_bone[2], upper_bone[1])) % (2 * np.pi)
    knee = turn("x", np.rad2deg(inner - rest))
    chain = upper_bone + knee @ lower_bone

    mirror = 1.0 if side == "left" else -1.0
    outward = turn("y", mirror * curves[f"{side}_foot_knee"])
    hinge = (pelvis @ outward)[:, :, 0] + foot[:, :, 0]
    hinge -= (hinge * line).sum(-1, keepdims=True) * line
    hinge /= np.linalg.norm(hinge, axis=-1, keepdims=True)
    along = chain / np.linalg.norm(chain, axis=-1, keepdims=True)
    across = np.broadcast_to(np.array([1.0, 0.0, 0.0]), along.shape)
    world = np.stack([hinge, line, np.cross(hinge, line)], axis=-1)
    local = np.stack([across, along, np.cross(across, along)], axis=-1)
    upper = world @ local.transpose(0, 2, 1)
    rotations[:, JOINT[f"{side}_hip"]] = pelvis.transpose(0, 2, 1) @ upper
    rotations[:, JOINT[f"{side}_knee"]] = knee
    rotations[:, JOINT[f"{side}_ankle"]] = (upper @ knee).transpose(0, 2, 1) @ foot
    rotations[:, JOINT[f"{side}_foot"]] = turn("x", -toes)
