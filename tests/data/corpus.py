"""Small sources of random motion that several tests share."""

from __future__ import annotations

import os
from collections.abc import Iterator
from collections.abc import Sequence as Ordered
from pathlib import Path

import torch

from motiongen.data.clips import Segment, Sequence
from motiongen.motion.representation import FEATURES, TRANSLATION
from motiongen.motion.skeleton import Skeleton
from tests.compositions import skeleton


class ListedSource:
    """Sequences that a test has made; counts how often it is parsed in a file, since that may be another process."""

    name = "listed"

    def __init__(
        self, listed: Ordered[Sequence], root_tags: frozenset[str] = frozenset(), log: Path | None = None
    ) -> None:
        self.listed = tuple(listed)
        self.root_tags = root_tags
        self.log = log

    def fingerprint(self) -> str:
        return "0123456789abcdef0123"

    def skeleton(self) -> Skeleton:
        return skeleton()

    def __len__(self) -> int:
        return len(self.listed)

    def sequences(self) -> Iterator[Sequence]:
        if self.log is not None:
            with self.log.open("a") as file:
                file.write(f"{os.getpid()}\n")
        yield from self.listed


def session(name: str, segments: Ordered[tuple[int, int, str]], frames: int, group: str | None = None) -> Sequence:
    """A sequence with a smooth random walk of all features.

    A segment's last entry is its tags, split at commas; after `@` come its styles in the same way.
    """
    generator = torch.Generator().manual_seed(sum(name.encode()))
    features = torch.randn(frames, FEATURES, generator=generator)
    features[:, TRANSLATION] = 0.02 * features[:, TRANSLATION].cumsum(dim=0)
    cut = tuple(Segment(start, stop, *_labels(labels)) for start, stop, labels in segments)
    return Sequence(name, group or name, features, cut)


def _labels(text: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    tags, _, styles = text.partition("@")
    return tuple(tags.split(",")), tuple(styles.split(",")) if styles else ()
