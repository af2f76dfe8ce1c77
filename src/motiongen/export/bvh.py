"""Biovision Hierarchy: the skeleton in its T-pose, and Euler angles frame by frame."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import roma
from numpy.typing import NDArray

from motiongen.export.axes import y_up_pose
from motiongen.export.scene import Scene
from motiongen.motion.skeleton import JOINT_NAMES, PARENTS

CENTIMETRES = 100.0
ROTATIONS = "Zrotation Xrotation Yrotation"
END = 0.5
"""Length of a tip beyond the last joints, in lengths of the bone before: programs draw a bone there."""

Array = NDArray[np.float64]


def encode_bvh(scene: Scene) -> bytes:
    """The motion in a world whose y is up, in centimetres and degrees; joints bear SMPL's names.

    With all rotations zero the skeleton stands in SMPL's T-pose and faces +z. The pelvis' position channels are its
    place in the world: its OFFSET is zero, so that it makes no difference whether a program adds it.
    """
    rotations, pelvis = y_up_pose(scene)
    angles = _continuous(roma.rotmat_to_euler("ZXY", rotations, degrees=True).numpy())
    order = list(_depth_first(0))
    frames = np.concatenate([CENTIMETRES * pelvis.numpy(), angles[:, order].reshape(scene.frames, -1)], axis=1)
    offsets = CENTIMETRES * scene.body.skeleton.offsets.detach().cpu().double().numpy()
    lines = ["HIERARCHY", *_joint(0, offsets, 0)]
    lines += ["MOTION", f"Frames: {scene.frames}", f"Frame Time: {1 / scene.fps:.9f}"]
    lines += [_numbers(frame) for frame in frames]
    return ("\n".join(lines) + "\n").encode()


def _continuous(angles: Array) -> Array:
    """Angles (T, J, 3) in degrees of the same rotations that change as little as they can from frame to frame.

    A program that looks between two frames would show a limb that spins where angles jump. (z, x, y) and
    (z + 180, 180 - x, y + 180) are one rotation, and so is whatever differs by full turns.
    """
    found = angles.copy()
    for frame in range(1, len(found)):
        before = found[frame - 1]
        same = np.stack([angles[frame], angles[frame] * [1, -1, 1] + 180.0])
        same += 360.0 * np.round((before - same) / 360.0)
        other_is_nearer = np.abs(same[1] - before).sum(axis=-1) < np.abs(same[0] - before).sum(axis=-1)
        found[frame] = np.where(other_is_nearer[:, None], same[1], same[0])
    return found


def _depth_first(joint: int) -> Iterator[int]:
    """The joint and all below it, in the order of the file."""
    yield joint
    for child in _children(joint):
        yield from _depth_first(child)


def _children(joint: int) -> list[int]:
    return [child for child, parent in enumerate(PARENTS) if parent == joint]


def _joint(joint: int, offsets: Array, depth: int) -> Iterator[str]:
    """The lines of a joint's block."""
    tab = "\t" * depth
    yield f"{tab}{'JOINT' if depth else 'ROOT'} {JOINT_NAMES[joint]}"
    yield f"{tab}{{"
    yield f"{tab}\tOFFSET {_numbers(offsets[joint])}"
    yield f"{tab}\tCHANNELS " + (f"3 {ROTATIONS}" if depth else f"6 Xposition Yposition Zposition {ROTATIONS}")
    for child in _children(joint):
        yield from _joint(child, offsets, depth + 1)
    if not _children(joint):
        yield from (f"{tab}\tEnd Site", f"{tab}\t{{", f"{tab}\t\tOFFSET {_numbers(END * offsets[joint])}", f"{tab}\t}}")
    yield f"{tab}}}"


def _numbers(values: Array) -> str:
    return " ".join(f"{value:.6f}" for value in values)
