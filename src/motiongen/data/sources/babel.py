"""BABEL (Punnakkal et al. 2021): what is done when in the recordings of AMASS."""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any, Literal

from motiongen.data.clips import DataError, Divisible, Job, Segment, Sequence, Side
from motiongen.data.roots import check_root
from motiongen.data.sources import babel_mag
from motiongen.data.sources.amass import People, checksums, read_amass
from motiongen.data.sources.files import digest, read_json, required
from motiongen.data.sources.retarget import FPS
from motiongen.files import is_file
from motiongen.motion.skeleton import Skeleton
from motiongen.options import PositiveInt

PARSER_VERSION = 1
"""Counted up whenever the same files give other features or labels, so that older stores are not taken for new ones."""

RELEASE = "babel_v1.0_release"
FILES: dict[str, Side] = {"train": "train", "val": "test", "extra_train": "train", "extra_val": "test"}
"""Files and the side that they are on; those named extra may be absent. The labels of `test` are withheld."""
ALIASES = {"BioMotionLab_NTroje": "BMLrub", "DFaust_67": "DFaust"}
"""Folders that AMASS has renamed."""
TRANSITION = "transition"
TRAVELS = frozenset(
    {"walk", "run", "jog", "jump", "hop", "step", "move up/down incline"}
    | {"forward movement", "backwards movement", "sideways movement"}
)
MOST_LABELS = 2000
"""Labels that a recording may have; each is compared with all others."""
SHOWN = 5
"""Missing files that a message names."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Label:
    """Times in frames at 30 Hz."""

    start: int
    stop: int
    words: str
    categories: frozenset[str]


@dataclass(frozen=True)
class _Recording:
    path: Path
    side: Side
    segments: tuple[Segment, ...]


class Babel(Divisible):
    """A folder with `babel_v1.0_release/` (https://babel.is.tue.mpg.de) and `amass/` (https://amass.is.tue.mpg.de).

    Of BABEL's files `train.json` and `val.json` are needed, `extra_train.json` and `extra_val.json` read if they are
    there. AMASS may be the release with SMPL-H or the one with SMPL-X parameters.

    Where a recording has frame annotations, these are taken, else its sequence annotations, which last from beginning
    to end; in files with several annotators the first. Every span of time that is labelled is a segment, with the tags
    of all labels that cover it from beginning to end; labels that merely overlap do not share tags. Transitions are no
    segments, but their frames are there, before and after others. Recordings without a segment are left out, and so are
    those whose files are missing, with one warning.

    Args:
        root: the folder.
        amass: where AMASS's data sets are unpacked, in `root` or anywhere.
        bodies: SMPL's model files for AMASS's people, see `amass.People`.
        labels: `categories` are BABEL's own (act_cat), `mag` the 31 tags of `babel_mag`.
        most_frequent: keep only so many categories, those with the most segments; none keeps all.
        official_split: whether `val` is tested. Else the split is drawn from all recordings.

    Raises:
        DataError: when constructed, if a folder or label file is missing or damaged, or all recordings are missing;
            from a recording's job, if it is damaged.
    """

    def __init__(
        self,
        *,
        root: str,
        amass: str = "amass",
        bodies: str | None = None,
        labels: Literal["categories", "mag"] = "categories",
        most_frequent: PositiveInt | None = None,
        official_split: bool = True,
    ) -> None:
        self._root = check_root(root)
        self._amass = self._root / Path(amass).expanduser()
        self._labels = labels
        self._official = official_split
        self._people = People(bodies)
        self.name = "babel_mag_auto" if labels == "mag" else f"babel_{most_frequent}" if most_frequent else "babel"
        self.root_tags = babel_mag.ROOT_TAGS if labels == "mag" else TRAVELS
        recordings = self._recordings()
        kept = _most_frequent(recordings, most_frequent)
        reduced = (replace(recording, segments=_with_tags(recording.segments, kept)) for recording in recordings)
        self._kept = [recording for recording in reduced if recording.segments]

    def fingerprint(self) -> str:
        labels = [(self._name(one), one.side, one.segments) for one in self._kept]
        arrays = [checksums(one.path) for one in self._kept]
        bones = self._people.skeleton.offsets.tolist()
        return digest(self._root, (), self.name, PARSER_VERSION, self._official, labels, arrays, bones)

    def skeleton(self) -> Skeleton:
        return self._people.skeleton

    def __len__(self) -> int:
        return len(self._kept)

    def jobs(self) -> list[Job]:
        return [Job(self._name(one), (one.path,), partial(self._read, one)) for one in self._kept]

    def _read(self, recording: _Recording) -> Iterator[Sequence]:
        pose = read_amass(recording.path, self._people)
        inside = (segment for segment in recording.segments if segment.start < len(pose))
        segments = tuple(replace(segment, stop=min(segment.stop, len(pose))) for segment in inside)
        name = self._name(recording)
        yield Sequence(name, name, pose, segments, recording.side if self._official else None)

    def _name(self, recording: _Recording) -> str:
        return recording.path.relative_to(self._amass).as_posix()

    def _label_files(self) -> dict[str, Path]:
        paths = {name: self._root / RELEASE / f"{name}.json" for name in FILES}
        for name in ("train", "val"):
            required(paths[name])
        return {name: path for name, path in paths.items() if path.is_file()}

    def _recordings(self) -> list[_Recording]:
        """Each recording once, from the first file that labels it."""
        found: dict[Path, _Recording] = {}
        missing: list[str] = []
        for name, file in self._label_files().items():
            content = read_json(file)
            if not isinstance(content, dict):
                raise DataError(f"{file}: holds a {type(content).__name__}, not an entry per recording")
            for sid, entry in content.items():
                where = f"{file}: {sid:.100}"
                named, labels = _read_entry(where, entry)
                path = self._find(where, named)
                if path is None:
                    missing.append(named)
                elif path not in found:
                    found[path] = _Recording(path, FILES[name], tuple(self._segments(labels)))
        if missing:
            names = ", ".join(f"{name:.200}" for name in missing[:SHOWN]) + (", ..." if len(missing) > SHOWN else "")
            if not found:
                raise DataError(
                    f"{self._amass}: none of the {len(missing)} recordings that BABEL labels is there: {names}; "
                    f"data.source.amass=<the folder into which AMASS's data sets were unpacked>"
                )
            _log.warning("%s: %d recordings that BABEL labels are missing: %s", self._amass, len(missing), names)
        return list(found.values())

    def _find(self, where: str, named: str) -> Path | None:
        """The file of a `feat_p`, with or without its first folder, under the names of either release of AMASS."""
        parts = PurePosixPath(named).parts
        if not parts or ".." in parts or PurePosixPath(named).is_absolute():
            raise DataError(f"{where}: feat_p: {named!r:.200} is not a path in AMASS's folder")
        renamed = tuple(ALIASES.get(part, part) for part in parts)
        for candidate in (parts, parts[1:], renamed, renamed[1:]):
            path = self._amass.joinpath(*candidate)
            for file in (path, path.with_name(path.name.replace("_poses.npz", "_stageii.npz"))):
                if is_file(file):
                    return file
        return None

    def _segments(self, labels: list[_Label]) -> Iterator[Segment]:
        for start, stop in sorted({(label.start, label.stop) for label in labels}):
            covering = [label for label in labels if label.start <= start and stop <= label.stop]
            if self._labels == "mag":
                tags = babel_mag.mag_tags((label.words, label.categories) for label in covering)
            else:
                tags = tuple(sorted(frozenset().union(*(label.categories for label in covering))))
            if tags:
                yield Segment(start, stop, tags)


def _read_entry(where: str, entry: Any) -> tuple[str, list[_Label]]:
    """The recording that an entry is about, and its labels but for transitions and those without a category."""
    try:
        frame = entry.get("frame_ann") or next(filter(None, entry.get("frame_anns") or ()), None)
        annotation = frame or entry.get("seq_ann") or next(filter(None, entry.get("seq_anns") or ()), None)
        labels = []
        rows = annotation["labels"] if annotation else ()
        if len(rows) > MOST_LABELS:
            raise DataError(f"{where}: labels: {len(rows)} are more than {MOST_LABELS}")
        for row in rows:
            start, stop = (row["start_t"], row["end_t"]) if frame else (0.0, entry["dur"])
            if not (math.isfinite(start) and math.isfinite(stop)):
                raise DataError(f"{where}: a label lasts from {start} to {stop}")
            words = str(row["proc_label"])
            categories = frozenset(map(str, row["act_cat"] or ())) - {TRANSITION}
            first, last = max(0, round(start * FPS)), round(stop * FPS)
            if categories and words != TRANSITION and first < last:
                labels.append(_Label(first, last, words, categories))
        return str(entry["feat_p"]), labels
    except (KeyError, TypeError, AttributeError, OverflowError) as error:
        raise DataError(f"{where}: {type(error).__name__}: {error!s:.500}") from error


def _most_frequent(recordings: Iterable[_Recording], count: int | None) -> frozenset[str]:
    """Tags of the most segments; among equals the first in the alphabet."""
    counts: Mapping[str, int] = Counter(tag for one in recordings for segment in one.segments for tag in segment.tags)
    return frozenset(sorted(counts, key=lambda tag: (-counts[tag], tag))[:count])


def _with_tags(segments: Iterable[Segment], kept: frozenset[str]) -> tuple[Segment, ...]:
    reduced = (replace(segment, tags=tuple(tag for tag in segment.tags if tag in kept)) for segment in segments)
    return tuple(segment for segment in reduced if segment.tags)
