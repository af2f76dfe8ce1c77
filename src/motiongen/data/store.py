"""A data set parsed once and memory-mapped from then on."""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from filelock import FileLock
from numpy.typing import NDArray
from rich import get_console
from rich.progress import Progress
from torch import Tensor

from motiongen.data.clips import DataError, Divisible, Job, Sequence, Source
from motiongen.data.index import INDEX_FILE, DamagedStore, read_index, write_index
from motiongen.data.journal import FEATURES_FILE, JOURNAL_FILE, Journal
from motiongen.data.reading import losses_named, readings
from motiongen.motion.representation import FEATURES
from motiongen.motion.skeleton import Skeleton

MAX_REJECTED = 0.2
"""Share of a source's parts that may be damaged before the whole is taken to be."""

_log = logging.getLogger(__name__)


class ClipStore:
    """Sequences of a data set on disk: `features.npy` (all frames one after another) and `index.json`.

    A store is written beside its place and moved there when it is complete, so a folder of that name is a whole store;
    its size and hash are checked whenever it is opened. A preparation that was broken off goes on where it was.
    """

    def __init__(self, folder: Path) -> None:
        """Open a complete store; use `ClipStore.open` to get one from a source.

        Raises:
            DamagedStore: it is not there, or not what was written.
        """
        self.folder = folder
        self.was_made = False
        index, self.sequences = read_index(folder)
        try:
            if _sha256(folder / FEATURES_FILE) != index["sha256"]:
                raise DamagedStore(f"{FEATURES_FILE}: is not what was written")
            self._frames = _mapped(folder)
        except DamagedStore:
            raise
        except Exception as error:
            # Damaged headers are evaluated as literals: it can be nearly any.
            raise DamagedStore(f"{FEATURES_FILE}: {type(error).__name__}: {error!s:.500}") from error
        frames = sum(sequence.length for sequence in self.sequences)
        if self._frames.dtype != np.float32 or self._frames.shape != (frames, FEATURES):
            raise DamagedStore(f"{FEATURES_FILE}: {self._frames.dtype} of {self._frames.shape}, not of {frames} frames")
        self.fingerprint: str = index["fingerprint"]
        self.skeleton = Skeleton(torch.tensor(index["skeleton"], dtype=torch.float32))
        self.root_tags: frozenset[str] = frozenset(index["root_tags"])
        self.quarantine: dict[str, str] = index["quarantine"]
        segments = [segment for sequence in self.sequences for segment in sequence.segments]
        self.tags: tuple[str, ...] = tuple(sorted({tag for segment in segments for tag in segment.tags}))
        self.styles: tuple[str, ...] = tuple(sorted({style for segment in segments for style in segment.styles}))

    @classmethod
    def open(
        cls, source: Source, cache: Path | str, max_rejected: float = MAX_REJECTED, workers: int | None = None
    ) -> ClipStore:
        """The source's store below `cache`, made first where it is missing, damaged or of another fingerprint.

        Any number of processes may ask at once: one makes the store, the others wait for it.

        Args:
            source: parts of it that are damaged are left out, with the reason in `quarantine`.
            cache: the folder of all stores.
            max_rejected: the share of parts above which they are not left out, 0 to 1.
            workers: processes that read parts, see `readings`; the store is the same whatever their number.

        Raises:
            DataError: too many parts are damaged, or all of a source that has no parts; nothing is left behind then.
            LostReader: one of the processes was killed; what was read until then is kept.
        """
        fingerprint = source.fingerprint()
        folder = Path(cache).expanduser() / "clips" / f"{source.name}-{fingerprint[:16]}"
        folder.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(folder.with_name(f"{folder.name}.lock")):
            if folder.exists():
                try:
                    store = cls(folder)
                    if store.fingerprint != fingerprint:
                        raise DamagedStore(f"{INDEX_FILE}: fingerprint: that of another source")
                    return store
                except DamagedStore as damage:
                    _log.warning("The store %s is damaged (%s) and is made anew", folder, damage)
                    shutil.rmtree(folder)
            # Whatever a process left that was killed here: only the holder of the lock gets to see it.
            unfinished = folder.with_name(f"{folder.name}.unfinished")
            try:
                _write(source, fingerprint, unfinished, max_rejected, workers)
            except DataError:
                shutil.rmtree(unfinished)
                raise
            os.replace(unfinished, folder)
            store = cls(folder)
            store.was_made = True
            return store

    def __getstate__(self) -> dict[str, Any]:
        """Without the frames, which a process that gets the store maps by itself."""
        return {name: value for name, value in self.__dict__.items() if name != "_frames"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._frames = _mapped(self.folder)

    def features(self, index: int, start: int = 0, stop: int | None = None) -> Tensor:
        """A copy of frames [start, stop) of a sequence, (T, 135) float32; all of them by default."""
        sequence = self.sequences[index]
        stop = sequence.length if stop is None else stop
        if not 0 <= start <= stop <= sequence.length:
            raise IndexError(f"frames {start} to {stop} of {sequence.name}, which has {sequence.length}")
        return torch.from_numpy(np.array(self._frames[sequence.first + start : sequence.first + stop]))


def _mapped(folder: Path) -> NDArray[np.float32]:
    frames: NDArray[np.float32] = np.lib.format.open_memmap(folder / FEATURES_FILE, mode="r")
    return frames


def _write(source: Source, fingerprint: str, folder: Path, max_rejected: float, workers: int | None) -> None:
    jobs = source.jobs() if isinstance(source, Divisible) else [Job(source.name, (), source.sequences)]
    with Journal(folder, fingerprint, [job.name for job in jobs]) as journal, losses_named():
        _fill(source, jobs, journal, max_rejected, workers)
        rows = [row for job in jobs for row in journal.done[job.name].get("sequences", ())]
        if not rows:
            raise DataError(next(iter(journal.rejected.values()), f"{source.name}: no sequences"))
        journal.seal()
    index = {
        "source": source.name,
        "fingerprint": fingerprint,
        "sha256": _sha256(folder / FEATURES_FILE),
        "skeleton": source.skeleton().offsets.tolist(),
        "root_tags": sorted(source.root_tags),
        "sequences": _with_first(rows),
        "quarantine": journal.rejected,
    }
    write_index(folder, index)
    (folder / JOURNAL_FILE).unlink()


def _fill(source: Source, jobs: list[Job], journal: Journal, max_rejected: float, workers: int | None) -> None:
    """Read every part that the journal has not yet; stop as soon as it is certain that too many are damaged."""
    waiting = [job for job in jobs if job.name not in journal.done]
    _say_what_is_there(source, waiting, len(jobs))
    names = {row["name"] for entry in journal.done.values() for row in entry.get("sequences", ())}
    # Drawn anew by a thread only where somebody watches.
    with Progress(transient=True, auto_refresh=get_console().is_terminal) as progress:

        def announce(seconds: float) -> None:
            progress.print(f"{source.name}: about {seconds:.0f} seconds to go", markup=False)

        bar = progress.add_task(f"Preparing {source.name}", total=len(source))
        progress.advance(bar, len(names) + len(journal.rejected))
        for job, sequences in readings(waiting, workers, announce):
            _refuse_too_many(source, journal.rejected, len(jobs), max_rejected)
            rows: list[dict[str, Any]] = []
            try:
                for sequence in sequences:
                    _check(source, sequence, names)
                    journal.append(sequence.features.numpy().tobytes())
                    rows.append(_row(sequence))
                    names.add(sequence.name)
                    progress.advance(bar)
                journal.close_part(job.name, rows)
            except DataError as error:
                journal.reject_part(job.name, str(error))
                names -= {row["name"] for row in rows}
    _refuse_too_many(source, journal.rejected, len(jobs), max_rejected)


def _say_what_is_there(source: Source, waiting: list[Job], count: int) -> None:
    paths = [path for job in waiting for path in job.paths]
    sizes = [path.stat().st_size for path in paths if path.is_file()]
    if paths:
        _log.info(
            f"{source.name}: {len(waiting)} of {count} parts are to be read, {len(paths)} files of "
            f"{sum(sizes) / 1e6:.1f} MB; {len(paths) - len(sizes)} files are missing"
        )


def _refuse_too_many(source: Source, rejected: Mapping[str, str], count: int, share: float) -> None:
    if len(rejected) > share * count:
        first = next(iter(rejected.values()))
        few = (
            f"{source.name}: {len(rejected)} of {count} parts are damaged, more than data.max_rejected={share:g} allows"
        )
        raise DataError(first if count == 1 else f"{first}\n{few}")


def _row(sequence: Sequence) -> dict[str, Any]:
    segments = [asdict(segment) for segment in sequence.segments]
    return {
        "name": sequence.name,
        "group": sequence.group,
        "length": len(sequence.features),
        "segments": segments,
        "side": sequence.side,
    }


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


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
