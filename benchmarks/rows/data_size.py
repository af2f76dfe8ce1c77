"""What training input costs against the size of the data set; no reference.

The data are hours of built-in motion: copies of one hour, each under names of its own. Opening verifies the checksum of
all frames. Setting up splits the clips and draws the windows of an epoch. Motions are read at random places.
Memory is what the process holds of its own above what it held before; pages of the file, which the system takes back
when it needs them, are not counted.
"""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

from benchmarks.measuring import Effort, slope
from benchmarks.results import Figure, Result
from motiongen.data.clips import Sequence
from motiongen.data.datamodule import MotionData
from motiongen.data.sources.builtin.source import BLOCK, BuiltinSource
from motiongen.motion.skeleton import Skeleton

TITLE = "Cost against the size of the data set"


class Copies:
    """A source of so many copies of the same sessions."""

    name = "copies"

    def __init__(self, hour: list[Sequence], count: int) -> None:
        self._hour, self._count = hour, count
        self.root_tags = BuiltinSource().root_tags

    def fingerprint(self) -> str:
        return f"{self._count} times {len(self._hour)} sessions".ljust(16)

    def skeleton(self) -> Skeleton:
        return BuiltinSource().skeleton()

    def __len__(self) -> int:
        return self._count * len(self._hour)

    def sequences(self) -> Iterator[Sequence]:
        for number in range(self._count):
            for session in self._hour:
                name = f"{number}/{session.name}"
                yield replace(session, name=name, group=name)


def measure(effort: Effort) -> list[Result]:
    hour = list(BuiltinSource(sessions=effort.size(BLOCK, 4), repertoire="babel_mag").sequences())
    held = _own_mebibytes()
    hours = [1, 2] if effort.quick else [1, 10, 100]
    found: list[Result] = []
    opening, setting_up = [], []
    with tempfile.TemporaryDirectory() as folder:
        for count in hours:
            source = Copies(hour, count)
            MotionData(source=source, cache=folder, max_frames=60, min_clips=2)
            start = time.perf_counter()
            data = MotionData(source=source, cache=folder, max_frames=60, min_clips=2)
            opened = time.perf_counter()
            batches = iter(data.train_batches(0))
            next(batches)
            ready = time.perf_counter()
            motions = sum(len(batch.motion) for batch in islice(batches, effort.size(200, 1)))
            rate = motions / (time.perf_counter() - ready)
            opening.append(opened - start)
            setting_up.append(ready - opened)
            found += [
                Figure(f"{count} hours, opened and split", opening[-1], "s"),
                Figure(f"{count} hours, an epoch set up", setting_up[-1], "s"),
                Figure(f"{count} hours, batches", rate, "motions / s"),
                Figure(f"{count} hours, memory", _own_mebibytes() - held, "MiB"),
            ]
    return [
        *found,
        Figure("opened and split, slope over hours", slope(hours, opening)),
        Figure("an epoch set up, slope over hours", slope(hours, setting_up)),
    ]


def _own_mebibytes() -> float:
    """Resident memory of this process without files' pages; 0 where the system does not tell."""
    status = Path("/proc/self/status")
    match = re.search(r"RssAnon:\s+(\d+) kB", status.read_text()) if status.is_file() else None
    return int(match[1]) / 1024 if match else 0.0
