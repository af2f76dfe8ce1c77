"""What the joints, axes and units of BVH files mean: read from a mapping, or guessed from the files."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from collections.abc import Sequence as Ordered
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, cast, get_args

import roma
import torch
import yaml
from torch import Tensor

from motiongen.data.roots import DataError
from motiongen.data.sources.bvh import Bvh
from motiongen.data.sources.bvh_names import OPTIONAL, Names, guess_names
from motiongen.data.sources.rest_pose import align_from_motion, align_from_zero_pose, is_upright
from motiongen.data.sources.retarget import WORLD_FROM_Y_UP
from motiongen.documents import DocumentError, read_yaml
from motiongen.motion.skeleton import JOINT, JOINT_NAMES, JOINTS, PARENTS

Up = Literal["y", "z"]
UNITS = {"metres": 1.0, "inches": 0.0254, "centimetres": 0.01, "Acclaim's units": 0.0254 / 0.45, "millimetres": 0.001}
LEG = ("left_ankle", "left_knee", "left_hip")
TRUNK = ("pelvis", "spine1", "spine2", "spine3", "neck", "head")
TALL = 1.4
"""Metres along an adult's leg and trunk, from the ankle to the head joint, as in SMPL's mean body."""
TALL_RANGE = (0.9, 2.2)
UPRIGHT = 0.7
"""Cosine up to which the way from the ankles to the head says which axis is up."""
MOST_FRAMES = 2000
"""Enough to tell how a body holds itself on average."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Rig:
    """How to read a file's joints. What is None is told from each file's own rest pose."""

    names: Names
    """The file's name of every SMPL joint; None for one that keeps to its parent."""
    up: Up
    metres: float
    """Length of the file's unit."""
    align: Tensor | None = None
    """(22, 3, 3) float64 joint frames in SMPL's T-pose, where they are not those of the rest pose"""

    def selected(self, path: Path, bvh: Bvh) -> tuple[Tensor, Tensor]:
        """World rotations (T, 22, 3, 3) and positions (T, 22, 3), y up, in the file's units.

        Raises:
            DataError: the file lacks a joint.
        """
        columns: list[int] = []
        for joint, parent in zip(JOINT_NAMES, PARENTS, strict=True):
            name = self.names[joint]
            if name is None:
                columns.append(columns[parent])
            elif name in bvh.names:
                columns.append(bvh.names.index(name))
            else:
                raise DataError(f"{path}: HIERARCHY: joint {name} is missing, which stands for {joint}")
        rotations, positions = bvh.world()
        rotations, positions = rotations[:, columns], positions[:, columns]
        return (
            (rotations, positions) if self.up == "y" else (WORLD_FROM_Y_UP.T @ rotations, positions @ WORLD_FROM_Y_UP)
        )

    def aligned(self, path: Path, bvh: Bvh) -> Tensor:
        """(22, 3, 3) the joint frames in SMPL's T-pose.

        Raises:
            DataError: the file does not show them.
        """
        if self.align is not None:
            return self.align
        pose = self.standing(path, bvh)
        if pose is None:
            raise DataError(
                f"{path}: HIERARCHY: with zero rotations the body does not stand; the mapping needs `align`"
            )
        return _finite(path, align_from_zero_pose(*pose))

    def standing(self, path: Path, bvh: Bvh) -> tuple[Tensor, Tensor] | None:
        """Joint frames (22, 3, 3) and joints (22, 3), y up, with zero rotations; None if the body does not stand.

        What is up there need not be what is up in the motion: the root may be turned all the time.
        """
        for up in get_args(Up):
            rotations, positions = replace(self, up=up).selected(path, _zero_pose(bvh))
            if is_upright(positions[0]):
                return rotations[0], positions[0]
        return None


def _zero_pose(bvh: Bvh) -> Bvh:
    """One frame in which nothing is turned."""
    identity = torch.eye(3, dtype=torch.float64).expand(1, len(bvh.names), 3, 3)
    return replace(bvh, rotations=identity, positions=bvh.positions.median(dim=0, keepdim=True).values)


def guess_rig(files: Ordered[tuple[Path, Bvh]], names: Names | None, up: Up | None, metres: float | None) -> Rig:
    """The rig of these files; what is not None is taken as it is.

    Raises:
        DataError: the files do not show it; the message says which setting to give.
    """
    path, first = files[0]
    if names is None:
        try:
            convention, names = guess_names(first.names)
        except ValueError as error:
            raise DataError(f"{path}: HIERARCHY: {error}; give data.source.mapping") from error
        _log.info("Joints are named as in %s", convention)
    rig = Rig(names, "y", 1.0)
    poses = [rig.selected(file, bvh) for file, bvh in files]
    up = up or _guess_up(path, torch.cat([positions for _, positions in poses]))
    rig = Rig(names, up, metres or _guess_unit(path, torch.cat([positions for _, positions in poses])))
    _log.info("%s is up, the unit is %g m", up, rig.metres)
    if rig.standing(path, first) is not None:
        return rig
    step = -(-sum(len(rotations) for rotations, _ in poses) // MOST_FRAMES)
    turned = [rig.selected(file, bvh) for file, bvh in files]
    rotations, positions = (torch.cat([pose[part][::step] for pose in turned]) for part in (0, 1))
    align = _finite(path, align_from_motion(rotations, positions))
    _log.info("With zero rotations the body does not stand: joint frames are told from the motion")
    return replace(rig, align=roma.special_procrustes(align.round(decimals=6)))


def _guess_up(path: Path, positions: Tensor) -> Up:
    ankles = positions[:, [JOINT["left_ankle"], JOINT["right_ankle"]]].mean(dim=1)
    way = (positions[:, JOINT["head"]] - ankles).mean(dim=0)
    for axis, value in (("y", way[1]), ("z", way[2])):
        if value > UPRIGHT * way.norm():
            return cast(Up, axis)
    raise DataError(f"{path}: neither y nor z leads from the feet to the head; give data.source.up")


def _guess_unit(path: Path, positions: Tensor) -> float:
    tall = float((_length(positions, LEG) + _length(positions, TRUNK)).median())
    unit = min(UNITS, key=lambda name: abs(math.log(max(tall * UNITS[name], 1e-9) / TALL)))
    if not TALL_RANGE[0] < tall * UNITS[unit] < TALL_RANGE[1]:
        raise DataError(f"{path}: a body of {tall:g} units is no person's in any unit; give data.source.metres")
    return UNITS[unit]


def _length(positions: Tensor, line: Ordered[str]) -> Tensor:
    """(T,) along joints that follow one another"""
    joints = positions[:, [JOINT[name] for name in line]]
    return (joints[:, 1:] - joints[:, :-1]).norm(dim=-1).sum(dim=1)


def _finite(path: Path, align: Tensor) -> Tensor:
    if not align.isfinite().all():
        raise DataError(f"{path}: a limb points away from where it does in SMPL's T-pose; the mapping needs `align`")
    return align


def write_mapping(path: Path, rig: Rig) -> None:
    """The rig as a file that `read_mapping` takes."""
    content = {"up": rig.up, "metres": rig.metres, "joints": dict(rig.names)}
    text = yaml.safe_dump(content, sort_keys=False)
    if rig.align is not None:
        text += "align:\n" + "".join(
            f"  {joint}: {[[round(value, 6) + 0.0 for value in row] for row in frame]}\n"
            for joint, frame in zip(JOINT_NAMES, rig.align.tolist(), strict=True)
        )
    path.write_text(text, encoding="utf-8")


def read_mapping(path: Path) -> tuple[Names, Up | None, float | None, Tensor | None]:
    """Joint names, and where the file has them the axis that is up, the unit in metres and `align` (22, 3, 3).

    Raises:
        DataError: the file is missing or not of this form; the message names the field.
    """
    content = _read_yaml(path)
    if unknown := set(content) - {"up", "metres", "joints", "align"}:
        raise DataError(
            f"{path}: {min(map(str, unknown))}: there is no such field; there are joints, up, metres, align"
        )
    names = content.get("joints")
    if not isinstance(names, Mapping) or set(names) != set(JOINT_NAMES):
        raise DataError(f"{path}: joints: has to give a name for each of {', '.join(JOINT_NAMES)}")
    for joint, name in names.items():
        if not isinstance(name, str) and not (name is None and joint in OPTIONAL):
            raise DataError(f"{path}: joints: {joint}: {name!r} is no joint's name")
    up, metres = content.get("up"), content.get("metres")
    if up not in ("y", "z", None):
        raise DataError(f"{path}: up: {up!r} is neither y nor z")
    if metres is not None and not (isinstance(metres, (int, float)) and 0 < metres < math.inf):
        raise DataError(f"{path}: metres: {metres!r} is not a length")
    return names, cast("Up | None", up), metres, _align(path, content.get("align"))


def _read_yaml(path: Path) -> dict[Any, Any]:
    try:
        content = read_yaml(path)
    except DocumentError as error:
        raise DataError(f"{path}: {error}") from error
    if not isinstance(content, dict):
        raise DataError(f"{path}: not a set of fields")
    return content


def _align(path: Path, rows: object) -> Tensor | None:
    if rows is None:
        return None
    try:
        align = torch.tensor([cast(Any, rows)[joint] for joint in JOINT_NAMES], dtype=torch.float64)
    except (TypeError, ValueError, KeyError, OverflowError) as error:
        raise DataError(f"{path}: align: {type(error).__name__}: {error}") from error
    identity = torch.eye(3, dtype=torch.float64)
    if align.shape != (JOINTS, 3, 3) or not (align @ align.mT - identity).abs().max() < 1e-3 or align.det().min() < 0:
        raise DataError(f"{path}: align: not a rotation matrix for each joint")
    return roma.special_procrustes(align)
