"""Wall time of command lines that only answer, each in a process of its own."""

from __future__ import annotations

import subprocess
import sys
from functools import partial

from benchmarks.measuring import Effort, interleaved
from benchmarks.results import Figure, Result

TITLE = "The command line"
LINES = {
    "--help": ("--help",),
    "task=list": ("task=list",),
    "an option that does not exist": ("+experiment=marionnette",),
    "a key that does not exist": ("+experiment=marionette", "generator.decoder.layer=2"),
    "a value of the wrong type": ("+experiment=marionette", "generator.decoder.layers=2.5"),
}


def answer(arguments: tuple[str, ...]) -> None:
    subprocess.run([sys.executable, "-m", "motiongen", *arguments], capture_output=True, check=False)


def measure(effort: Effort) -> list[Result]:
    chosen = dict(list(LINES.items())[: effort.size(len(LINES), 1)])
    taken = interleaved({name: partial(answer, line) for name, line in chosen.items()}, effort)
    return [Figure(name, timing.median, "s", "under 1 s") for name, timing in taken.items()]
