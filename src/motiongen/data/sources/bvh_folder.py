"""Any folder of BVH files: a mapping says which joints stand for SMPL's, names or a table say what is done."""

from __future__ import annotations

import hashlib
import logging
import os
from collections.abc import Iterable, Iterator
from functools import cached_property
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from motiongen.data.clips import DataError, Divisible, Job, Segment, Sequence
from motiongen.data.sources.bvh import Bvh, read_bvh
from motiongen.data.sources.bvh_rig import Rig, Up, guess_rig, read_mapping, write_mapping
from motiongen.data.sources.labelled_files import LabelledFiles
from motiongen.data.sources.rest_pose import bones
from motiongen.data.sources.retarget import at_thirty, features, rotation_between, smpl_pose
from motiongen.motion.skeleton import JOINT, JOINT_NAMES, JOINTS, PARENTS, Skeleton

PARSER_VERSION = 1
"""Counted up whenever the same files give other features or labels, so that older stores are not taken for new ones."""
SAMPLES = 10
"""Files, at even distances, from which rig and mean shape are told."""
NECK, HEAD = JOINT["neck"], JOINT["head"]

_log = logging.getLogger(__name__)


class BvhFolder(Divisible):
    """BVH files below a folder, each a sequence of one action.

    Rotations are kept; positions are scaled by leg length to the mean shape, so that all feet stand on one floor.

    Args:
        root: the folder.
        mapping: a YAML file with the joints' names, axes, unit and frames; without one they are guessed.
        pattern: of the files' names, see `LabelledFiles`; without one a table or the folders' names are the labels.
        up: the axis that is up, in place of what the mapping says or the files show.
        metres: the length of the files' unit, likewise.
        root_tags: tags of actions that travel.
        guesses: the folder in which a guessed mapping is written down.

    Raises:
        DataError: when constructed, if the folder, the mapping, the pattern or the labels are missing or wrong; from a
            file's job, if that file is.
    """

    name = "bvh_folder"

    def __init__(
        self,
        *,
        root: str,
        mapping: str | None = None,
        pattern: str | None = None,
        up: Up | None = None,
        metres: float | None = None,
        root_tags: Iterable[str] = (),
        guesses: str | None = None,
    ) -> None:
        self._mapping = None if mapping is None else Path(mapping).expanduser()
        self._written = None if self._mapping is None else read_mapping(self._mapping)
        self._files = LabelledFiles(root, ".bvh", pattern)
        self._root = self._files.root
        self.root_tags = frozenset(root_tags)
        self._up, self._metres = up, metres
        self._guesses = None if guesses is None else Path(guesses).expanduser()

    def fingerprint(self) -> str:
        written = None if self._mapping is None else self._mapping.read_text(encoding="utf-8")
        tags = sorted(self.root_tags)
        return self._files.fingerprint(self.name, PARSER_VERSION, written, self._up, self._metres, tags)

    def skeleton(self) -> Skeleton:
        """The mean shape of some of the files."""
        return Skeleton(torch.stack([self._pose(path, bvh)[2] for path, bvh in self._samples]).mean(dim=0).float())

    def __len__(self) -> int:
        return len(self._files.paths)

    def jobs(self) -> list[Job]:
        return self._files.jobs(self._read)

    def _read(self, path: Path) -> Iterator[Sequence]:
        label = self._files.label(path)
        bvh = read_bvh(path)
        local, pelvis, offsets = self._pose(path, bvh)
        scale = self._legs / Skeleton(offsets.float()).leg_length
        pose = features(*at_thirty(path, local, pelvis * scale, bvh.fps))
        yield Sequence(label.name, label.group, pose, (Segment(0, len(pose), label.tags, label.styles),))

    def _pose(self, path: Path, bvh: Bvh) -> tuple[Tensor, Tensor, Tensor]:
        """Local rotations (T, 22, 3, 3), pelvis positions (T, 3) and bone offsets (22, 3), metres, z up."""
        rotations, positions = self.rig.selected(path, bvh)
        align = self.rig.aligned(path, bvh)
        positions = positions * self.rig.metres
        offsets = _offsets(self.rig, rotations, positions, align)
        if _parent(bvh, self.rig.names["head"]) not in (self.rig.names["neck"], self.rig.names["spine3"]):
            # SMPL has one joint where this neck has several: it points to the head.
            pointing = rotations[:, NECK] @ align[NECK].T @ offsets[HEAD]
            turn = rotation_between(pointing, positions[:, HEAD] - positions[:, NECK])
            rotations[:, NECK] = turn @ rotations[:, NECK]
        local, pelvis = smpl_pose(rotations, align, positions[:, 0])
        return local, pelvis, offsets

    @cached_property
    def rig(self) -> Rig:
        """What the files' joints, axes and units mean."""
        if self._written is None:
            rig = guess_rig(self._samples, None, self._up, self._metres)
            self._write_down(rig)
            return rig
        names, up, metres, align = self._written
        up, metres = self._up or up, self._metres or metres
        if align is not None and up is not None and metres is not None:
            return Rig(names, up, metres, align)
        rig = guess_rig(self._samples, names, up, metres)
        return rig if align is None else Rig(names, rig.up, rig.metres, align)

    def _write_down(self, rig: Rig) -> None:
        if self._guesses is None:
            return
        self._guesses.mkdir(parents=True, exist_ok=True)
        place = hashlib.sha256(os.fsencode(self._root.resolve())).hexdigest()[:8]
        path = self._guesses / f"{self._root.resolve().name}-{place}.yaml"
        write_mapping(path, rig)
        _log.info("The mapping was guessed and written to %s; edit it and give data.source.mapping=%s", path, path)

    @cached_property
    def _samples(self) -> list[tuple[Path, Bvh]]:
        found: list[tuple[Path, Bvh]] = []
        reasons: list[DataError] = []
        for place in np.unique(np.linspace(0, len(self._files.paths) - 1, SAMPLES).round().astype(int)):
            path = self._files.paths[place]
            try:
                if self._files.is_inside(path):
                    found.append((path, read_bvh(path)))
            except DataError as error:
                reasons.append(error)
        if not found:
            raise reasons[0] if reasons else DataError(f"{self._root}: the .bvh files lead out of the folder")
        return found

    @cached_property
    def _legs(self) -> float:
        return self.skeleton().leg_length


def _offsets(rig: Rig, rotations: Tensor, positions: Tensor, align: Tensor) -> Tensor:
    """(22, 3) each joint from its parent in the T-pose; joints that a rig lacks divide the bone evenly."""
    chains: list[list[int]] = []
    for joint in range(1, JOINTS):
        if rig.names[JOINT_NAMES[joint]] is None:
            continue
        chain = [joint]
        while rig.names[JOINT_NAMES[PARENTS[chain[-1]]]] is None:
            chain.append(PARENTS[chain[-1]])
        chains.append(chain)
    starts = [PARENTS[chain[-1]] for chain in chains]
    ends = bones(rotations, positions, [(start, chain[0]) for start, chain in zip(starts, chains, strict=True)])
    offsets = torch.zeros(JOINTS, 3, dtype=torch.float64)
    for chain, bone in zip(chains, (align[starts] @ ends.unsqueeze(-1)).squeeze(-1), strict=True):
        offsets[chain] = bone / len(chain)
    return offsets


def _parent(bvh: Bvh, name: str | None) -> str | None:
    parent = bvh.parents[bvh.names.index(name or "")]
    return bvh.names[parent] if parent >= 0 else None
