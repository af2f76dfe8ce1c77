"""What a data set delivers: continuous sequences with labelled segments."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol, runtime_checkable

from torch import Tensor

from motiongen.data.roots import DataError
from motiongen.motion.skeleton import Skeleton

__all__ = ["INITIAL_FRAMES", "DataError", "Divisible", "Job", "Segment", "Sequence", "Side", "Source", "Span"]

INITIAL_FRAMES = 6
"""K, the frames of motion that are given before an action (Neural Marionette, section 3.1)."""

Side = Literal["train", "test"]

Span = tuple[str, str, int, int]
"""Frames of a data set, wherever it is named: store fingerprint, sequence name, first frame, frame after the last."""


@dataclass(frozen=True)
class Segment:
    """One labelled action: frames [start, stop) of its sequence."""

    start: int
    stop: int
    tags: tuple[str, ...]
    styles: tuple[str, ...] = ()
    """The manner in which it is done; empty where that is not labelled."""


@dataclass(frozen=True)
class Sequence:
    """Continuous motion in the world frame at 30 Hz."""

    name: str
    group: str
    """Sequences of one group never straddle the split."""
    features: Tensor
    """(T, 135) float32"""
    segments: tuple[Segment, ...]
    """In time order."""
    side: Side | None = None
    """Where the data set's own split has it; none leaves that to `data.splits`. All sequences have one or none has."""


class Source(Protocol):
    """A data set that can be parsed into sequences."""

    name: str
    root_tags: frozenset[str]
    """Tags of actions that travel, for which a trajectory applies."""

    def fingerprint(self) -> str:
        """Hex digest of the source files' content and of every setting that changes the result."""
        ...

    def skeleton(self) -> Skeleton:
        """The mean shape of the data."""
        ...

    def __len__(self) -> int:
        """How many sequences will come."""
        ...

    def sequences(self) -> Iterator[Sequence]: ...


@dataclass(frozen=True)
class Job:
    """A part of a source that is read by itself, as a rule one file; jobs have different names."""

    name: str
    paths: tuple[Path, ...]
    """The files that it reads, for those who want to know how much there is."""
    read: Callable[[], Iterable[Sequence]]
    """Raises DataError if this part is damaged."""


@runtime_checkable
class Divisible(Protocol):
    """A source that offers its parts: damaged ones are left out, and a preparation that was broken off goes on."""

    def jobs(self) -> list[Job]:
        """The parts."""
        ...

    def sequences(self) -> Iterator[Sequence]:
        """Those of all parts, one after another."""
        for job in self.jobs():
            yield from job.read()
