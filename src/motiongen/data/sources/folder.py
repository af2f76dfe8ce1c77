"""Motions in a folder of one's own: NPZ or BVH files, with `labels.csv` beside them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import roma
import torch
from torch import Tensor

from motiongen.data.clips import DataError, Segment, Sequence
from motiongen.data.roots import check_root
from motiongen.data.sources.arrays import per_frame, read_arrays
from motiongen.data.sources.bvh import read_bvh
from motiongen.data.sources.files import digest, read_table, required
from motiongen.data.sources.retarget import FPS, at_thirty, features, smpl_pose
from motiongen.files import is_file
from motiongen.motion.representation import FEATURES, unpack
from motiongen.motion.skeleton import JOINT_NAMES, JOINTS, Skeleton

PARSER_VERSION = 2
"""Counted up whenever the same files give other features, so that older stores are not taken for new ones."""
LABELS = "labels.csv"
FIELDS = ("features", "poses", "trans", "rest_pelvis", "mocap_framerate", "fps")
CENTIMETRES = 10.0
"""A BVH file whose pelvis is higher than this is in centimetres."""


class MotionFolder:
    """Files that `labels.csv` lists in its columns `file` and `tags` (several tags with `+` between them).

    - NPZ with `poses` (T, 66 or more): SMPL's axis angles, pelvis first, in a z-up world as AMASS has it, and `trans`
      (T, 3) in metres, taken for the pelvis' position, to which `rest_pelvis` (3,) is added where the file has it, as
      exported files do; `mocap_framerate` or `fps`, else 30 Hz.
    - NPZ with `features` (T, 135), as `task=synthesize` writes; `fps` as above.
    - BVH, y up, whose joints bear the 22 SMPL names (other joints are left out), in metres or centimetres; with zero
      rotations the body stands in SMPL's T-pose.

    Args:
        root: the folder.
        skeleton: the body that they are shown on.

    Raises:
        DataError: when constructed, if the folder, the labels or a file is missing; from `sequences`, if a file is not
            of one of these forms, with the file and the field.
    """

    name = "folder"
    root_tags: frozenset[str] = frozenset()

    def __init__(self, *, root: str, skeleton: Skeleton) -> None:
        self._root = check_root(root, "motions")
        self._skeleton = skeleton
        self._labels = read_labels(self._root / LABELS)

    def fingerprint(self) -> str:
        paths = [self._root / LABELS, *(self._root / name for name in self._labels)]
        return digest(self._root, paths, self.name, PARSER_VERSION)

    def skeleton(self) -> Skeleton:
        return self._skeleton

    def __len__(self) -> int:
        return len(self._labels)

    def sequences(self) -> Iterator[Sequence]:
        for name, tags in self._labels.items():
            pose = read_motion(self._root / name)
            yield Sequence(name, name, pose, (Segment(0, len(pose), tags),))


def read_motion(path: Path) -> Tensor:
    """The motion of one NPZ or BVH file as features (T, 135) at 30 Hz.

    Raises:
        DataError: no such file, not of one of the forms above, or not finite.
    """
    required(path)
    pose = features(*(_bvh(path) if path.suffix.lower() == ".bvh" else _npz(path)))
    if not pose.isfinite().all():
        raise DataError(f"{path}: a frame is not finite")
    return pose


def read_labels(path: Path) -> dict[str, tuple[str, ...]]:
    """The tags of every file that a table with the columns `file` and `tags` lists; the files are there.

    Raises:
        DataError: the table or a file is missing, or the table is not of this form.
    """
    rows = read_table(path, ("file", "tags"))
    labels = {row["file"]: tuple(tag.strip() for tag in row["tags"].split("+")) for row in rows}
    if not labels:
        raise DataError(f"{path}: no files are listed")
    for name, tags in labels.items():
        if not all(tags):
            raise DataError(f"{path}: tags of {name!r:.200}: {'+'.join(tags)!r:.200} has an empty tag")
        if not is_file(path.parent / name):
            raise DataError(f"{path}: {name[:200]}: the file is missing")
        if not (path.parent / name).resolve().is_relative_to(path.parent.resolve()):
            raise DataError(f"{path}: file {name!r} lies outside the folder")
    return labels


def _npz(path: Path) -> tuple[Tensor, Tensor]:
    """Local rotations (T, 22, 3, 3) and pelvis positions (T, 3), at 30 Hz."""
    content = {name: array for name, array in read_arrays(path, FIELDS).items() if array.dtype.kind in "fiu"}
    if "features" in content:
        local, pelvis = unpack(per_frame(path, content, "features", FEATURES))
    else:
        turns = per_frame(path, content, "poses", 3 * JOINTS)
        local = roma.rotvec_to_rotmat(turns.reshape(-1, JOINTS, 3))
        rest = content.get("rest_pelvis", np.zeros(3))
        if rest.shape != (3,):
            raise DataError(f"{path}: field 'rest_pelvis' has shape {rest.shape}, not (3,)")
        pelvis = per_frame(path, content, "trans", 3) + torch.from_numpy(rest.astype(np.float64))
    if len(local) != len(pelvis):
        raise DataError(f"{path}: 'poses' has {len(local)} frames and 'trans' {len(pelvis)}")
    rate = content.get("mocap_framerate", content.get("fps", np.array(FPS)))
    if rate.size != 1:
        raise DataError(f"{path}: field 'mocap_framerate' or 'fps' has shape {rate.shape}, not ()")
    return at_thirty(path, local, pelvis, float(rate.item()))


def _bvh(path: Path) -> tuple[Tensor, Tensor]:
    bvh = read_bvh(path)
    if missing := [name for name in JOINT_NAMES if name not in bvh.names]:
        raise DataError(f"{path}: HIERARCHY: joint {missing[0]} is missing")
    rotations, positions = bvh.world()
    columns = [bvh.names.index(name) for name in JOINT_NAMES]
    pelvis = positions[:, columns[0]]
    metres = 0.01 if float(pelvis[:, 1].abs().max()) > CENTIMETRES else 1.0
    local, pelvis = smpl_pose(rotations[:, columns], torch.eye(3).to(rotations).expand(JOINTS, 3, 3), pelvis * metres)
    return at_thirty(path, local, pelvis, bvh.fps)
