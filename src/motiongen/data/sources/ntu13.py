"""NTU-13: 13 actions of NTU RGB+D 120 as Guo et al. 2020 chose them, estimated by VIBE. No longer distributed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from motiongen.data.clips import DataError, Divisible, Job, Segment, Sequence
from motiongen.data.roots import check_root
from motiongen.data.sources.arrays import per_frame, read_plain_pickle
from motiongen.data.sources.camera import upright, vibe_pelvis
from motiongen.data.sources.files import digest, read_text
from motiongen.files import is_file
from motiongen.motion.bodies import makehuman
from motiongen.motion.skeleton import JOINTS, Skeleton

PARSER_VERSION = 1
"""Counted up whenever the same files give other features or labels, so that older stores are not taken for new ones."""

FPS = 30.0
LIST = "ntu_vibe_list.txt"
PERSON = 1
"""The track that VIBE gives to the first person of a video."""
TAGS = {
    6: "pick up",
    7: "throw",
    8: "sit down",
    9: "stand up",
    22: "cheer up",
    23: "hand waving",
    24: "kick something",
    38: "salute",
    80: "squat down",
    93: "shake fist",
    99: "run on the spot",
    100: "butt kicks",
    102: "side kick",
}


class Ntu13(Divisible):
    """The folder with `ntu_vibe_list.txt` and the joblib files that it lists; no longer distributed.

    The number after `A` in a file's name is its action. Files of one performer (the number after `P`) stay on one side
    of the split. Bones are those of the built-in figure.

    Args:
        root: the folder.

    Raises:
        DataError: when constructed, if the list or a file is missing or a name tells none of the 13 actions; from
            a file's job, if it is damaged or VIBE found nobody in it.
    """

    name = "ntu13"
    root_tags: frozenset[str] = frozenset()

    def __init__(self, *, root: str) -> None:
        self._root = check_root(root)
        lines = read_text(self._root / LIST, errors="strict").splitlines()
        self._files = [self._listed(line.strip()) for line in lines if line.strip()]
        self._skeleton = makehuman().skeleton

    def fingerprint(self) -> str:
        bones = self._skeleton.offsets.tolist()
        return digest(self._root, [self._root / LIST, *self._files], self.name, PARSER_VERSION, bones)

    def skeleton(self) -> Skeleton:
        return self._skeleton

    def __len__(self) -> int:
        return len(self._files)

    def jobs(self) -> list[Job]:
        return [Job(self._name(file), (file,), partial(self._read, file)) for file in self._files]

    def _name(self, file: Path) -> str:
        return file.relative_to(self._root).as_posix()

    def _read(self, file: Path) -> Iterator[Sequence]:
        content = read_plain_pickle(file)
        if not isinstance(content, dict):
            raise DataError(f"{file}: holds a {type(content).__name__}, not VIBE's dictionary")
        if PERSON not in content:
            raise DataError(f"{file}: VIBE found nobody")
        found = content[PERSON]
        if not isinstance(found, dict) or "joints3d" not in found:
            raise DataError(f"{file}: field 'joints3d' is missing")
        turns = per_frame(file, found, "pose", 3 * JOINTS)
        pelvis = vibe_pelvis(str(file), found["joints3d"])
        if len(turns) != len(pelvis):
            raise DataError(f"{file}: {len(turns)} poses and {len(pelvis)} joints3d")
        pose = upright(file, turns, pelvis, self._skeleton, FPS)
        performer = re.search(r"P\d+", file.name)
        name = self._name(file)
        yield Sequence(name, performer[0] if performer else name, pose, (Segment(0, len(pose), (_tag(file),)),))

    def _listed(self, line: str) -> Path:
        path = self._root / line
        if not is_file(path):
            raise DataError(f"{self._root / LIST}: {line:.200}: the file is missing from the data set")
        if not path.resolve().is_relative_to(self._root.resolve()):
            raise DataError(f"{self._root / LIST}: file {line!r:.200} lies outside the folder")
        _tag(path)
        return path


def _tag(file: Path) -> str:
    match = re.search(r"A(\d+)", file.name)
    if match is None or int(match[1]) not in TAGS:
        raise DataError(f"{file}: the number after 'A' in the name is none of {', '.join(map(str, TAGS))}")
    return TAGS[int(match[1])]
