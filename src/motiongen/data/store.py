"""A data set parsed once and memory-mapped from then on."""

from __future__ import annotations

import hashlib
import json
import logging
import os
import shutil
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import torch
from filelock import FileLock
from rich.progress import track
from torch import Tensor

from motiongen.data.clips import DataError, Segment, Sequence, Side, Source
from motiongen.motion.representation import FEATURES
from motiongen.motion.skeleton import Skeleton

FORMAT = 3
"""Counted up when the layout on disk changes."""

_log = logging.getLogger(__name__)


class DamagedStore(DataError):
    """A folder that is no store, or no longer one."""


@dataclass(frozen=True)
class StoredSequence:
    """What is known of a sequence without reading its frames."""

    name: str
    group: str
    length: int
    first: int
    """Its first row in the table of all frames."""
    segments: tuple[Segment, ...]
    side: Side | None
    """As in `Sequence`."""


class ClipStore:
    """Sequences of a data set on disk: `features.npy` (all frames one after another) and `index.json`.

    A store is written beside its place and moved there when it is complete, so a folder of that name is a whole store;
    its size and hash are checked whenever it is opened.
    """

    def __init__(self, folder: Path) -> None:
        """Open a complete store; use `ClipStore.open` to get one from a source."""
        try:
            index = json.loads((folder / "index.json").read_bytes())
            if index["format"] != FORMAT:
                raise DamagedStore(f"format {index['format']} instead of {FORMAT}")
            if _sha256(folder / "features.npy") != index["sha256"]:
                raise DamagedStore("features.npy is not what was written")
            self._frames = np.load(folder / "features.npy", mmap_mode="r", allow_pickle=False)
            self.fingerprint: str = index["fingerprint"]
            self.skeleton = Skeleton(torch.tensor(index["skeleton"], dtype=torch.float32))
            self.root_tags: frozenset[str] = frozenset(index["root_tags"])
            self.sequences: tuple[StoredSequence, ...] = tuple(_stored(row) for row in index["sequences"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DamagedStore(f"{type(error).__name__}: {error}") from error
        segments = [segment for sequence in self.sequences for segment in sequence.segments]
        self.tags: tuple[str, ...] = tuple(sorted({tag for segment in segments for tag in segment.tags}))
        self.styles: tuple[str, ...] = tuple(sorted({style for segment in segments for style in segment.styles}))

    @classmethod
    def open(cls, source: Source, cache: Path | str) -> ClipStore:
        """The source's store below `cache`, made first where it is missing, damaged or of another fingerprint.

        Any number of processes may ask at once: one makes the store, the others wait for it.

        Raises:
            DataError: the source delivers something that is not of the promised form; nothing is left behind then.
        """
        fingerprint = source.fingerprint()
        folder = Path(cache).expanduser() / "clips" / f"{source.name}-{fingerprint[:16]}"
        folder.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(folder.with_name(f"{folder.name}.lock")):
            if folder.exists():
                try:
                    return cls(folder)
                except DamagedStore as damage:
                    _log.warning("The store %s is damaged (%s) and is made anew", folder, damage)
                    shutil.rmtree(folder)
            unfinished = folder.with_name(f"{folder.name}.unfinished")
            # A process that was killed here left its part; only the holder of the lock gets to see it.
            shutil.rmtree(unfinished, ignore_errors=True)
            unfinished.mkdir()
            try:
                _write(source, fingerprint, unfinished)
                os.replace(unfinished, folder)
            except BaseException:
                shutil.rmtree(unfinished, ignore_errors=True)
                raise
            return cls(folder)

    def features(self, index: int, start: int = 0, stop: int | None = None) -> Tensor:
        """A copy of frames [start, stop) of a sequence, (T, 135) float32; all of them by default."""
        sequence = self.sequences[index]
        stop = sequence.length if stop is None else stop
        if not 0 <= start <= stop <= sequence.length:
            raise IndexError(f"frames {start} to {stop} of {sequence.name}, which has {sequence.length}")
        return torch.from_numpy(np.array(self._frames[sequence.first + start : sequence.first + stop]))


def _write(source: Source, fingerprint: str, folder: Path) -> None:
    rows: list[dict[str, Any]] = []
    names: set[str] = set()
    total = 0
    with (folder / "features.npy").open("wb") as file:
        _write_header(file, 0)
        for sequence in _with_progress(source):
            _check(source, sequence, names)
            names.add(sequence.name)
            file.write(sequence.features.numpy().tobytes())
            length = len(sequence.features)
            rows.append(
                {
                    "name": sequence.name,
                    "group": sequence.group,
                    "length": length,
                    "segments": [asdict(segment) for segment in sequence.segments],
                    "side": sequence.side,
                }
            )
            total += length
        # NumPy pads headers so that the count of rows can grow in place.
        file.seek(0)
        _write_header(file, total)
    if not rows:
        raise DataError(f"{source.name}: no sequences")
    index = {
        "format": FORMAT,
        "source": source.name,
        "fingerprint": fingerprint,
        "sha256": _sha256(folder / "features.npy"),
        "skeleton": source.skeleton().offsets.tolist(),
        "root_tags": sorted(source.root_tags),
        "sequences": _with_first(rows),
    }
    (folder / "index.json").write_text(json.dumps(index), encoding="utf-8")


def _with_progress(source: Source) -> Iterator[Sequence]:
    yield from track(source.sequences(), description=f"Preparing {source.name}", total=len(source))


def _write_header(file: BinaryIO, frames: int) -> None:
    header = {"descr": "<f4", "fortran_order": False, "shape": (frames, FEATURES)}
    np.lib.format.write_array_header_1_0(file, header)


def _with_first(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    first = np.cumsum([0, *(row["length"] for row in rows)])
    return [{**row, "first": int(start)} for row, start in zip(rows, first[:-1], strict=True)]


def _check(source: Source, sequence: Sequence, names: set[str]) -> None:
    what = f"{source.name}: sequence {sequence.name}"
    pose = sequence.features
    if sequence.name in names:
        raise DataError(f"{what}: name: used twice")
    if pose.dtype != torch.float32 or pose.ndim != 2 or pose.shape[1] != FEATURES or len(pose) == 0:
        raise DataError(f"{what}: features: {pose.dtype} {tuple(pose.shape)}, not float32 (T, {FEATURES})")
    if not pose.isfinite().all():
        raise DataError(f"{what}: features: not finite at frame {int((~pose.isfinite()).any(1).nonzero()[0])}")
    starts = [segment.start for segment in sequence.segments]
    if starts != sorted(starts):
        raise DataError(f"{what}: segments: not in time order")
    for segment in sequence.segments:
        if not 0 <= segment.start < segment.stop <= len(pose) or not segment.tags:
            raise DataError(f"{what}: segments: {segment} in {len(pose)} frames")


def _stored(row: dict[str, Any]) -> StoredSequence:
    segments = tuple(
        Segment(item["start"], item["stop"], tuple(item["tags"]), tuple(item["styles"])) for item in row["segments"]
    )
    return StoredSequence(row["name"], row["group"], row["length"], row["first"], segments, row["side"])


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
