"""What is in a data set, in numbers."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from statistics import median

import numpy as np
from numpy.typing import NDArray

from motiongen.data.datamodule import MotionData
from motiongen.data.splits import Clip

FPS = 30.0
ALL = "(all)"
"""The row that counts every clip once."""


@dataclass(frozen=True)
class Statistics:
    """Counts of a store and its split; clips are labelled segments."""

    sequences: int
    frames: int
    clips: list[int]
    """The frames of each."""
    used: int
    """Clips that are on one side of the split."""
    lengths: dict[str, list[int]]
    """By tag, the frames of each of its clips."""
    train: Counter[str]
    test: Counter[str]
    transitions: NDArray[np.int64]
    """(A, A): how often the tag of the column follows that of the row, both in the order of `lengths`"""

    @property
    def tags(self) -> tuple[str, ...]:
        return tuple(self.lengths)

    def rows(self) -> list[dict[str, str]]:
        """A line a tag, and one for all, as text."""
        return [
            {
                "tag": tag,
                "clips": str(len(own)),
                "training": str(self.train[tag]),
                "test": str(self.test[tag]),
                "seconds, shortest": f"{min(own) / FPS:.1f}",
                "median": f"{median(own) / FPS:.1f}",
                "longest": f"{max(own) / FPS:.1f}",
            }
            for tag, own in {**self.lengths, ALL: self.clips}.items()
        ]


def statistics_of(data: MotionData) -> Statistics:
    """Count what is in the store and in the split; of clips with several tags, every tag counts."""
    store = data.store
    lengths: dict[str, list[int]] = {tag: [] for tag in store.tags}
    place = {tag: number for number, tag in enumerate(store.tags)}
    transitions = np.zeros((len(place), len(place)), dtype=np.int64)
    for sequence in store.sequences:
        for segment in sequence.segments:
            for tag in segment.tags:
                lengths[tag].append(segment.stop - segment.start)
        for before, after in zip(sequence.segments, sequence.segments[1:], strict=False):
            rows, columns = ([place[tag] for tag in segment.tags] for segment in (before, after))
            transitions[np.ix_(rows, columns)] += 1
    return Statistics(
        sequences=len(store.sequences),
        frames=sum(sequence.length for sequence in store.sequences),
        clips=[segment.stop - segment.start for sequence in store.sequences for segment in sequence.segments],
        used=len(data.split.train) + len(data.split.test),
        lengths=lengths,
        train=_count(data, data.split.train),
        test=_count(data, data.split.test),
        transitions=transitions,
    )


def _count(data: MotionData, clips: tuple[Clip, ...]) -> Counter[str]:
    """Clips by tag, and all of them."""
    tags = Counter(tag for clip in clips for tag in data.store.sequences[clip.sequence].segments[clip.segment].tags)
    tags[ALL] = len(clips)
    return tags
