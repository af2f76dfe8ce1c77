"""Reading the parts of a source, in several processes where that pays."""

from __future__ import annotations

import pickle
import re
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

import torch
from torch.utils.data import DataLoader, Dataset

from motiongen.data.clips import DataError, Job, Sequence
from motiongen.errors import InputError

TIMED = 5
"""Parts that are read before it is said how long the rest will take, or fewer that take long."""
LONG = 10.0
"""Seconds from which on processes are worth their start."""
_KILLED = re.compile(r"DataLoader worker .* (killed by signal|exited unexpectedly)")


class LostReader(InputError):
    """A process that read parts was killed, as happens when memory runs out."""


@contextmanager
def losses_named() -> Iterator[None]:
    """PyTorch's word on a process that was killed, which may come at any moment, as a LostReader."""
    try:
        yield
    except RuntimeError as error:
        if not _KILLED.search(str(error)):
            raise
        raise LostReader(
            f"data.prepare_workers: a process that read the data was killed, perhaps for want of memory ({error}). "
            f"What was read until then is kept: the same command goes on from there, and prepare_workers=0 needs least"
        ) from error


def readings(
    jobs: list[Job], workers: int | None, announce: Callable[[float], None]
) -> Iterator[tuple[Job, Iterable[Sequence]]]:
    """Every part in its order with its sequences; iterating over these raises DataError if the part is damaged.

    Args:
        jobs: the parts.
        workers: processes that read; 0 reads here, where the sequences of a part come one by one. None takes as many
            as PyTorch may use threads, where the first parts show that the rest will take long.
        announce: is told, after the first parts, how many seconds the rest will take.
    """
    started, done = time.monotonic(), 0
    while done < min(TIMED, len(jobs)) and time.monotonic() - started < LONG:
        yield jobs[done], _read(jobs[done])
        done += 1
    rest = jobs[done:]
    if not rest:
        return
    seconds = (time.monotonic() - started) / done * len(rest)
    if workers is None:
        threads = torch.get_num_threads()
        workers = threads if threads > 1 and seconds > LONG else 0
    announce(seconds / max(workers, 1))
    yield from zip(rest, _by_processes(rest, workers) if workers else map(_read, rest), strict=True)


def _read(job: Job) -> Iterator[Sequence]:
    yield from job.read()


class _Parcels(Dataset[bytes]):
    """Parts as a process hands them over. PyTorch would pass tensors through shared memory, which containers lack."""

    def __init__(self, jobs: list[Job]) -> None:
        self._jobs = jobs

    def __len__(self) -> int:
        return len(self._jobs)

    def __getitem__(self, index: int) -> bytes:
        try:
            return pickle.dumps(list(self._jobs[index].read()))
        except DataError as error:
            return pickle.dumps(str(error))


def _by_processes(jobs: list[Job], workers: int) -> Iterator[Iterator[Sequence]]:
    parcels: DataLoader[bytes] = DataLoader(_Parcels(jobs), batch_size=None, num_workers=min(workers, len(jobs)))
    for parcel in parcels:
        yield _opened(pickle.loads(parcel))


def _opened(content: list[Sequence] | str) -> Iterator[Sequence]:
    if isinstance(content, str):
        raise DataError(content)
    yield from content
