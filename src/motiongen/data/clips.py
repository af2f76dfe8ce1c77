"""What a data set delivers: continuous sequences with labelled segments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, Protocol

from torch import Tensor

from motiongen.data.roots import DataError
from motiongen.motion.skeleton import Skeleton

__all__ = ["INITIAL_FRAMES", "DataError", "Segment", "Sequence", "Side", "Source", "Span"]

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
