"""HumanAct12 (Guo et al. 2020) with the SMPL poses that ACTOR's authors ship: one action a clip."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
import roma
import torch

from motiongen.data.clips import DataError, Segment, Sequence
from motiongen.data.roots import check_root
from motiongen.data.sources.arrays import per_frame, read_plain_pickle
from motiongen.data.sources.camera import upright
from motiongen.data.sources.files import digest, required
from motiongen.motion.kinematics import global_rotations
from motiongen.motion.skeleton import JOINTS, PARENTS, Skeleton
from motiongen.options import PositiveFloat

PARSER_VERSION = 1
"""Counted up whenever the same file gives other features or labels, so that older stores are not taken for new ones."""

FILE = "humanact12poses.pkl"
TAGS = (
    *("warm up", "walk", "run", "jump", "drink", "lift dumbbell"),
    *("sit", "eat", "turn steering wheel", "phone", "boxing", "throw"),
)
SMPL_JOINTS = 24


class HumanAct12:
    """The folder with `humanact12poses.pkl`, which ACTOR's repository (Mathux/ACTOR) tells how to download.

    The file says neither whose clip it is nor which clips are neighbours in a recording, and has no test split: clips
    are split one by one, and the same person may be on both sides. That all clips are trained on and tested, as papers
    have it, is not offered.

    Args:
        root: the folder.
        fps: frames per second, which the file does not say; at 30 the frames are taken as they are.

    Raises:
        DataError: when constructed, if the file is missing; later, if it is damaged.
    """

    name = "humanact12"
    root_tags = frozenset({"walk", "run", "jump"})

    def __init__(self, *, root: str, fps: PositiveFloat = 30.0) -> None:
        self._root = check_root(root)
        self._file = required(self._root / FILE)
        self._fps = fps

    def fingerprint(self) -> str:
        return digest(self._root, [self._file], self.name, PARSER_VERSION, self._fps)

    def skeleton(self) -> Skeleton:
        """The mean over all frames of every bone, as its parent joint sees it."""
        total, count = torch.zeros(JOINTS, 3, dtype=torch.float64), 0
        for index in range(len(self)):
            turns, joints = self._turns(index), self._joints(index)
            world = global_rotations(roma.rotvec_to_rotmat(turns.reshape(-1, JOINTS, 3)))
            parents = list(PARENTS[1:])
            bones = (joints[:, 1:] - joints[:, parents]).unsqueeze(-2) @ world[:, parents]
            total[1:] += bones.squeeze(-2).sum(dim=0)
            count += len(turns)
        return Skeleton((total / count).float())

    def __len__(self) -> int:
        return len(self._content["poses"])

    def sequences(self) -> Iterator[Sequence]:
        skeleton = self.skeleton()
        for index, label in enumerate(self._content["y"]):
            where = f"{self._file}: clip {index}"
            pose = upright(where, self._turns(index), self._joints(index)[:, 0], skeleton, self._fps)
            name = f"{index:04d}"
            yield Sequence(name, name, pose, (Segment(0, len(pose), (TAGS[label],)),))

    def _turns(self, index: int) -> torch.Tensor:
        """(T, 66)"""
        return per_frame(f"{self._file}: clip {index}", {"poses": self._content["poses"][index]}, "poses", 3 * JOINTS)

    def _joints(self, index: int) -> torch.Tensor:
        """(T, 22, 3) metres, in the camera's coordinates"""
        where, joints = f"{self._file}: clip {index}", self._content["joints3D"][index]
        expected = (len(self._content["poses"][index]), SMPL_JOINTS, 3)
        if not isinstance(joints, np.ndarray) or joints.shape != expected:
            raise DataError(f"{where}: field 'joints3D' has shape {getattr(joints, 'shape', ())}, not {expected}")
        rows = per_frame(where, {"joints3D": joints.reshape(len(joints), -1)}, "joints3D", 3 * SMPL_JOINTS)
        return rows.reshape(-1, SMPL_JOINTS, 3)[:, :JOINTS]

    @cached_property
    def _content(self) -> dict[str, Any]:
        content = read_plain_pickle(self._file)
        for field in ("poses", "joints3D", "y"):
            if not isinstance(content, dict) or not isinstance(content.get(field), list):
                raise DataError(f"{self._file}: field {field!r} is missing")
        if not len(content["poses"]) == len(content["joints3D"]) == len(content["y"]):
            raise DataError(f"{self._file}: fields 'poses', 'joints3D' and 'y' are not of the same length")
        for index, label in enumerate(content["y"]):
            if not isinstance(label, int | np.integer) or not 0 <= label < len(TAGS):
                plain = isinstance(label, int | float | str | np.generic)
                told = f"{label!r:.100}" if plain else f"a {type(label).__name__}"
                raise DataError(f"{self._file}: clip {index}: field 'y' is {told}, not 0 to {len(TAGS) - 1}")
        return content
