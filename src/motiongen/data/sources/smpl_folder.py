"""Any folder of NPZ files with SMPL-H or SMPL-X parameters as AMASS has them; names or a table say what is done."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from motiongen.data.clips import Divisible, Job, Segment, Sequence
from motiongen.data.sources.amass import People, read_amass
from motiongen.data.sources.labelled_files import LabelledFiles
from motiongen.motion.skeleton import Skeleton

PARSER_VERSION = 1
"""Counted up whenever the same files give other features or labels, so that older stores are not taken for new ones."""
SHAPES = ("shape.npz", "*_stagei.npz")
"""Files of AMASS that describe a person and do not move."""


class SmplFolder(Divisible):
    """NPZ files below a folder, each a sequence of one action: exports of fitting tools, or a part of AMASS.

    A file has `poses` (T, 66 or more), or `root_orient` (T, 3) and `pose_body` (T, 63), in radians, `trans` (T, 3) in
    metres, and `mocap_framerate`; it may have `gender`, `betas` and `surface_model_type`. z is up.

    Args:
        root: the folder.
        pattern: of the files' names, see `LabelledFiles`; without one a table or the folders' names are the labels.
        bodies: SMPL's model files, see `amass.People`.
        root_tags: tags of actions that travel.

    Raises:
        DataError: when constructed, if the folder, the bodies, the pattern or the labels are missing or wrong; from a
            file's job, if that file is.
    """

    name = "smpl_folder"

    def __init__(
        self, *, root: str, pattern: str | None = None, bodies: str | None = None, root_tags: Iterable[str] = ()
    ) -> None:
        self._files = LabelledFiles(root, ".npz", pattern, besides=SHAPES)
        self._people = People(bodies)
        self.root_tags = frozenset(root_tags)

    def fingerprint(self) -> str:
        bones = self._people.skeleton.offsets.tolist()
        return self._files.fingerprint(self.name, PARSER_VERSION, sorted(self.root_tags), bones)

    def skeleton(self) -> Skeleton:
        return self._people.skeleton

    def __len__(self) -> int:
        return len(self._files.paths)

    def jobs(self) -> list[Job]:
        return self._files.jobs(self._read)

    def _read(self, path: Path) -> Iterator[Sequence]:
        label = self._files.label(path)
        pose = read_amass(path, self._people)
        yield Sequence(label.name, label.group, pose, (Segment(0, len(pose), label.tags, label.styles),))
