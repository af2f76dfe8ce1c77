"""Five continuous CMU sequences of exercises (AMC, 120 Hz) with the labels of mocap6dataset (10 Hz)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from pathlib import Path

import roma
import torch
from torch import Tensor

from motiongen.data.clips import DataError, Divisible, Job, Segment, Sequence
from motiongen.data.roots import check_root
from motiongen.data.sources.amc import read_amc
from motiongen.data.sources.files import digest, read_json, read_text, required
from motiongen.data.sources.retarget import features, rotation_between, smpl_pose
from motiongen.motion.resampling import resample
from motiongen.motion.skeleton import JOINT, JOINT_NAMES, PARENTS, Skeleton

PARSER_VERSION = 1
"""Counted up whenever the same files give other features, so that older stores are not taken for new ones."""

SOURCE_FPS, LABEL_FPS, FPS = 120, 10, 30
METRES = 0.0254 / 0.45
"""Acclaim's unit is an inch over 0.45."""
ELBOW_TWIST = 30.0
"""Degrees about the arm by which the elbows' hinges lie off the vertical of SMPL's T-pose (axes 180, -+30, -+90)."""
FOOT_PITCH = 20.0
"""Degrees from the ankle down to the toes in the T-pose: as measured where both stand still on the floor."""
LONGEST = 10.0
"""Metres of a bone; some of the skeleton's have none, and are joints alone."""
PELVIS, NECK, HEAD = JOINT["pelvis"], JOINT["neck"], JOINT["head"]
BENT = [JOINT[f"{side}_{joint}"] for side in ("left", "right") for joint in ("knee", "ankle", "foot")]
"""Ends of the bones that are turned into the T-pose"""


@dataclass(frozen=True)
class _Bone:
    parent: str
    dof: str
    """Axes of the values in an AMC line."""
    axes: Tensor
    """(3, 3) the frame in which they turn"""
    offset: dict[str, Tensor]
    """Subject to (3,) metres from the parent"""


@dataclass(frozen=True)
class _Rest:
    """A subject in SMPL's T-pose."""

    align: Tensor
    """(22, 3, 3) joint frames in the T-pose"""
    skeleton: Skeleton


class CmuMocap6(Divisible):
    """The data set's folder: `amc/`, `truelabels/` and `skeleton.json`.

    Both subjects' rotations are kept, and their positions scaled by leg length to the mean of both skeletons, so that
    their feet stand on the same floor; joints then lie within a few centimetres of the scaled recording.

    Raises:
        DataError: when constructed, if the folder or one of a sequence's files is missing or the skeleton is wrong;
            from `sequences`, if a file is damaged or has labels out of range.
    """

    name = "cmu_mocap6"
    # As BABEL-MAG counts running and jogging, although these subjects stay within 20 cm.
    root_tags = frozenset({"Jog"})

    def __init__(self, *, root: str) -> None:
        self._root = check_root(root)
        self._actions, self._bones, self._joints = _skeleton(self._root / "skeleton.json")
        stems = {path.stem for pattern in ("amc/*.amc", "truelabels/*.txt") for path in self._root.glob(pattern)}
        if not stems:
            raise DataError(f"{self._root}: no files amc/*.amc")
        self._names = sorted(stems)
        for name in self._names:
            required(self._motion_file(name))
            required(self._label_file(name))
        self._rest = {subject: self._rest_of(subject) for subject in self._bones[self._joints[-1]].offset}

    def fingerprint(self) -> str:
        files = [file(name) for name in self._names for file in (self._motion_file, self._label_file)]
        return digest(self._root, [self._root / "skeleton.json", *files], self.name, PARSER_VERSION)

    def skeleton(self) -> Skeleton:
        """The mean of both subjects."""
        return Skeleton(torch.stack([rest.skeleton.offsets for rest in self._rest.values()]).mean(dim=0))

    def skeleton_of(self, name: str) -> Skeleton:
        """The skeleton of the subject who made a sequence."""
        return self._rest_of_sequence(name).skeleton

    def __len__(self) -> int:
        return len(self._names)

    def jobs(self) -> list[Job]:
        return [
            Job(name, (self._motion_file(name), self._label_file(name)), partial(self._read, name))
            for name in self._names
        ]

    def _read(self, name: str) -> Iterator[Sequence]:
        local, pelvis = self.pose(name)
        count = len(local)
        local, pelvis = resample(local, pelvis, SOURCE_FPS, FPS)
        scale = self.skeleton().leg_length / self.skeleton_of(name).leg_length
        segments = self._segments(self._label_file(name), count)
        yield Sequence(name, name, features(local, pelvis * scale), segments)

    def pose(self, name: str) -> tuple[Tensor, Tensor]:
        """A sequence at 120 Hz as recorded: local rotations (T, 22, 3, 3), pelvis (T, 3) in metres, z up."""
        rest = self._rest_of_sequence(name)
        rotations, positions = self._world(name)
        world = torch.stack([rotations[joint] for joint in self._joints], dim=1)
        # SMPL has one joint where this neck has two: it points to the head, whose distance varies by less than 1 cm.
        bone = rest.skeleton.offsets[HEAD].double()
        pointing = (world[:, NECK] @ rest.align[NECK].T) @ bone
        target = positions[self._joints[HEAD]] - positions[self._joints[NECK]]
        world[:, NECK] = rotation_between(pointing, target) @ world[:, NECK]
        return smpl_pose(world, rest.align, positions[self._joints[PELVIS]])

    def _rest_of_sequence(self, name: str) -> _Rest:
        subject = name.split("_")[0]
        if subject not in self._rest:
            raise DataError(f"{self._root / 'skeleton.json'}: joints: no offsets for subject {subject} of {name}")
        return self._rest[subject]

    def _motion_file(self, name: str) -> Path:
        return self._root / "amc" / f"{name}.amc"

    def _label_file(self, name: str) -> Path:
        return self._root / "truelabels" / f"{name}.txt"

    def _world(self, name: str) -> tuple[dict[str, Tensor], dict[str, Tensor]]:
        """Rotations (T, 3, 3) and positions (T, 3) of all bones in metres, y up."""
        widths = {"root": 6} | {bone: len(own.dof) for bone, own in self._bones.items()}
        values = read_amc(self._motion_file(name), widths)
        subject = name.split("_")[0]
        rotations = {"root": roma.euler_to_rotmat("xyz", values["root"][:, 3:], degrees=True)}
        positions = {"root": values["root"][:, :3] * METRES}
        for bone, own in self._bones.items():
            # Lower case: about fixed axes, first x, then y, then z.
            turn = roma.euler_to_rotmat(own.dof, values[bone], degrees=True)
            rotations[bone] = rotations[own.parent] @ own.axes @ turn @ own.axes.T
            positions[bone] = positions[own.parent] + rotations[own.parent] @ own.offset[subject]
        return rotations, positions

    def _rest_of(self, subject: str) -> _Rest:
        """Where all rotations are zero the arms are level, but the legs are splayed and the feet pitched."""
        bones = self._bones
        down = torch.tensor([0.0, -1.0, 0.0], dtype=torch.float64)
        pitch = torch.deg2rad(torch.tensor(FOOT_PITCH, dtype=torch.float64))
        forward = torch.stack([torch.zeros_like(pitch), -pitch.sin(), pitch.cos()])
        twist = roma.euler_to_rotmat("x", torch.tensor([ELBOW_TWIST], dtype=torch.float64), degrees=True)
        align = torch.eye(3, dtype=torch.float64).repeat(len(JOINT_NAMES), 1, 1)
        for side in ("left", "right"):
            for name, child, direction in (("hip", "knee", down), ("knee", "ankle", down), ("ankle", "foot", forward)):
                bone = bones[self._joints[JOINT[f"{side}_{child}"]]].offset[subject]
                align[JOINT[f"{side}_{name}"]] = rotation_between(bone, direction)
            align[JOINT[f"{side}_foot"]] = align[JOINT[f"{side}_ankle"]]
            align[[JOINT[f"{side}_shoulder"], JOINT[f"{side}_elbow"]]] = twist
        offsets = torch.zeros(len(JOINT_NAMES), 3, dtype=torch.float64)
        for joint, parent in enumerate(PARENTS[1:], start=1):
            bone, last = torch.zeros(3, dtype=torch.float64), self._joints[joint]
            # The head hangs on a second neck joint that SMPL lacks.
            while last != self._joints[parent]:
                bone, last = bone + bones[last].offset[subject], bones[last].parent
            offsets[joint] = align[parent] @ bone
        if not align.isfinite().all() or not offsets[[*BENT, HEAD]].norm(dim=1).all():
            raise DataError(
                f"{self._root / 'skeleton.json'}: joints: subject {subject:.100}: a leg or the neck is none"
            )
        return _Rest(align, Skeleton(offsets.float()))

    def _segments(self, path: Path, frames: int) -> tuple[Segment, ...]:
        """Label k holds for AMC frames 12 k to 12 k + 11, frames 3 k to 3 k + 2 at 30 Hz; the last may be cut."""
        words = read_text(path).split()
        wrong = next((place for place, word in enumerate(words) if word not in self._actions), None)
        if wrong is not None:
            raise DataError(f"{path}: label {wrong}: {words[wrong]!r:.100} is none of {', '.join(self._actions)}")
        if len(words) * (SOURCE_FPS // LABEL_FPS) < frames:
            raise DataError(f"{path}: {len(words)} labels for {frames} frames; is the file cut?")
        segments, start = [], 0
        last = (frames - 1) * FPS // SOURCE_FPS + 1
        for word, run in groupby(words):
            stop = min(start + len(list(run)) * FPS // LABEL_FPS, last)
            if stop > start:
                segments.append(Segment(start, stop, (self._actions[word],)))
            start = stop
        return tuple(segments)


def _skeleton(path: Path) -> tuple[dict[str, str], dict[str, _Bone], list[str]]:
    """Action names by label, bones in an order in which parents come first, and the bone for each of SMPL's joints."""
    content = read_json(path)
    bones: dict[str, _Bone] = {}
    try:
        actions = {str(label): str(name) for label, name in content["action_names"].items()}
        for name, row in content["joints"].items():
            if row["parent"] != "root" and row["parent"] not in bones:
                raise DataError(f"{path}: joints: {name}: parent {row['parent']} does not come before it")
            axis = torch.tensor(row["axis_deg"], dtype=torch.float64).reshape(3)
            offsets = {
                subject: torch.tensor(offset, dtype=torch.float64).reshape(3) * METRES
                for subject, offset in row["offset"].items()
            }
            if re.fullmatch("x?y?z?", row["dof"]) is None:
                raise DataError(f"{path}: joints: {name:.100}: dof: {row['dof']:.100}: not axes in the order x, y, z")
            bones[name] = _Bone(row["parent"], row["dof"], roma.euler_to_rotmat("xyz", axis, degrees=True), offsets)
            _check_bone(f"{path}: joints: {name:.100}", bones[name], next(iter(bones.values())).offset.keys())
        joints = [content["smpl22"][name] for name in JOINT_NAMES]
        for joint, parent in zip(joints, PARENTS, strict=True):
            above = _above(joint, bones)
            if joint != "root" if parent < 0 else joints[parent] not in above:
                raise DataError(f"{path}: smpl22: {joint:.100}: is not a joint below that of its parent")
    except (KeyError, TypeError, ValueError, AttributeError, RuntimeError, OverflowError) as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"{path}: {type(error).__name__}: {error!s:.500}") from error
    return actions, bones, joints


def _check_bone(where: str, bone: _Bone, subjects: Set[str]) -> None:
    if bone.offset.keys() != subjects or not subjects:
        raise DataError(f"{where}: offset: not one for each subject")
    if not bone.axes.isfinite().all() or not all(offset.norm() <= LONGEST for offset in bone.offset.values()):
        raise DataError(f"{where}: axis_deg or offset: not that of a person's bone")


def _above(joint: str, bones: Mapping[str, _Bone]) -> list[str]:
    """The bones on the way from a joint to the root, which comes last."""
    way: list[str] = []
    while joint != "root":
        joint = bones[joint].parent
        way.append(joint)
    return way
