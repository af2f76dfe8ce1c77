"""Bandai-Namco-Research-Motiondataset 1 and 2: BVH clips of one action in one style each, with JSON labels.

Every clip is a sequence of its own, also the few that continue one another: these share a group instead.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import torch
from torch import Tensor

from motiongen.data.clips import DataError, Divisible, Job, Segment, Sequence
from motiongen.data.roots import check_root
from motiongen.data.sources.bvh import Bvh, read_bvh
from motiongen.data.sources.files import LARGEST_VALUE, digest, read_json, read_table, read_text
from motiongen.data.sources.retarget import features, smpl_pose
from motiongen.files import is_file
from motiongen.motion.resampling import resample
from motiongen.motion.skeleton import JOINT, JOINT_NAMES, PARENTS, Skeleton

PARSER_VERSION = 2
"""Counted up whenever the same files give other features or labels, so that older stores are not taken for new ones."""

FPS = 30.0
METRES = 0.01
FOLDERS = ("Bandai-Namco-Research-Motiondataset-1", "Bandai-Namco-Research-Motiondataset-2")
CLIP_NAME = re.compile(r"(dataset-[12])_([^_]+)_([^_]+)_(\d+)")
UNUSABLE = frozenset({"mislabelled", "truncated", "absent"})
"""Kinds of notes on clips that no split may hold."""


@dataclass(frozen=True)
class _Clip:
    path: Path
    tag: str
    style: str
    group: str


class BandaiNamco(Divisible):
    """The data set's folder with `smpl22_mapping.json` and `clip_notes.csv` beside its two parts.

    Raises:
        DataError: when constructed, if the folder, a file that `manifest.csv` lists, a label or the mapping is missing
            or wrong; from `sequences`, if a BVH file is damaged.
    """

    name = "bandai"
    root_tags = frozenset(
        {"walk", "walk-back", "walk-left", "walk-right", "walk-turn-left", "walk-turn-right", "run", "dash"}
    )

    def __init__(self, *, root: str) -> None:
        self._root = check_root(root)
        self._joints, self._align, self._rest = _mapping(self._root / "smpl22_mapping.json")
        self._clips = _clips(self._root)

    def fingerprint(self) -> str:
        labels = [path for folder in FOLDERS for path in sorted((self._root / folder / "cfg").glob("*.txt"))]
        notes = [self._root / name for name in ("smpl22_mapping.json", "clip_notes.csv")]
        clips = [path for clip in self._clips for path in (clip.path, clip.path.with_suffix(".json"))]
        return digest(self._root, [*labels, *notes, *clips], self.name, PARSER_VERSION)

    def skeleton(self) -> Skeleton:
        """One shape: the bone offsets of all clips agree to 0.04 cm."""
        parents = list(PARENTS)
        offsets = self._rest - self._rest[parents]
        offsets[0] = 0.0
        return Skeleton(offsets.float())

    def __len__(self) -> int:
        return len(self._clips)

    def jobs(self) -> list[Job]:
        return [Job(clip.path.stem, (clip.path,), partial(self._read, clip)) for clip in self._clips]

    def _read(self, clip: _Clip) -> Iterator[Sequence]:
        pose = self._features(clip.path, read_bvh(clip.path))
        yield Sequence(clip.path.stem, clip.group, pose, (Segment(0, len(pose), (clip.tag,), (clip.style,)),))

    def _features(self, path: Path, bvh: Bvh) -> Tensor:
        missing = [name for name in self._joints if name not in bvh.names]
        if missing:
            raise DataError(f"{path}: HIERARCHY: joint {missing[0]} is missing")
        rotations, positions = bvh.world()
        columns = [bvh.names.index(name) for name in self._joints]
        # Hips' world position holds joint_Root's, which carries the travel of four clips.
        local, pelvis = smpl_pose(rotations[:, columns], self._align, positions[:, columns[0]] * METRES)
        if abs(bvh.fps - FPS) > 0.01:
            local, pelvis = resample(local, pelvis, bvh.fps, FPS)
        return features(local, pelvis)


def _mapping(path: Path) -> tuple[list[str], Tensor, Tensor]:
    """The BVH joint that stands for each SMPL joint, its frame in the T-pose (22, 3, 3) and the rest joints (22, 3)."""
    content = read_json(path)
    try:
        rows = sorted(content["joints"], key=lambda row: int(row["index"]))
        if [row["smpl"] for row in rows] != list(JOINT_NAMES):
            raise DataError(f"{path}: joints: not SMPL's 22 body joints")
        # spine2 has no counterpart and keeps to spine1, so that its local rotation is the identity.
        joints = [row["bvh"] or rows[JOINT["spine1"]]["bvh"] for row in rows]
        align = torch.tensor([row["align"] for row in rows], dtype=torch.float64).reshape(len(rows), 3, 3)
        rest = torch.tensor([row["rest_m"] for row in rows], dtype=torch.float64).reshape(len(rows), 3)
    except (KeyError, TypeError, ValueError, RuntimeError, OverflowError) as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"{path}: joints: {type(error).__name__}: {error!s:.500}") from error
    if not all(isinstance(name, str) for name in joints):
        raise DataError(f"{path}: joints: bvh is not a name for each")
    if not (align @ align.mT - torch.eye(3)).abs().max() < 1e-3 or not (rest.abs() < LARGEST_VALUE).all():
        raise DataError(f"{path}: joints: align is not a rotation for each, or rest_m not a place")
    return joints, align, rest


def _clips(root: Path) -> list[_Clip]:
    manifest = root / "manifest.csv"
    for row in read_table(manifest, ("path",)) if manifest.is_file() else []:
        if not is_file(root / row["path"]):
            raise DataError(f"{manifest}: path: {row['path'][:200]}: the file is missing from the data set")
    notes = read_table(root / "clip_notes.csv", ("clip", "kind", "note"))
    unusable = {row["clip"] for row in notes if row["kind"] in UNUSABLE}
    labelled: dict[Path, str] = {}
    for folder in FOLDERS:
        # The lines read "dataset-2_walk": the two parts share tags.
        lines = read_text(root / folder / "cfg" / "content_label.txt", errors="strict").split()
        contents = [line.split("_", 1)[-1] for line in lines]
        for path in sorted((root / folder / "data").glob("*.bvh")):
            if path.stem not in unusable:
                labelled[path] = _label(path.with_suffix(".json"), contents)
    if not labelled:
        raise DataError(f"{root}: no .bvh files in {' or '.join(f'{folder}/data' for folder in FOLDERS)}")
    groups = _groups([path.stem for path in labelled], notes)
    return [_Clip(path, tag, _name_parts(path.stem)[2], groups[path.stem]) for path, tag in labelled.items()]


def _label(path: Path, contents: list[str]) -> str:
    content = read_json(path)
    index = content.get("content") if isinstance(content, dict) else None
    if not isinstance(index, int) or not 0 <= index < len(contents):
        raise DataError(
            f"{path}: content: {index!r:.100} is not a line number below {len(contents)} of content_label.txt"
        )
    return contents[index]


def _name_parts(name: str) -> tuple[str, ...]:
    """Data set, content, style and take of a clip."""
    match = CLIP_NAME.fullmatch(name)
    if match is None:
        raise DataError(f"{name}.bvh: the name is not dataset-<1 or 2>_<content>_<style>_<take>")
    return match.groups()


def _groups(names: list[str], notes: list[dict[str, str]]) -> dict[str, str]:
    """Clips that share frames, continue one another or are neighbouring takes of one action and style get one group.

    Named after its first clip.
    """
    leader = {name: name for name in names}

    def find(name: str) -> str:
        while leader[name] != name:
            name = leader[name]
        return name

    def join(one: str, other: str) -> None:
        first, second = sorted((find(one), find(other)))
        leader[second] = first

    for name in names:
        dataset, content, style, take = _name_parts(name)
        neighbour = f"{dataset}_{content}_{style}_{int(take) + 1:03d}"
        if neighbour in leader:
            join(name, neighbour)
    for row in notes:
        for match in CLIP_NAME.finditer(row["note"]):
            if row["clip"] in leader and match.group() in leader:
                join(row["clip"], match.group())
    return {name: find(name) for name in names}
