"""What a trial measured, read from the folder that its job left behind."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from motiongen.errors import InputError
from motiongen.evaluation.table import FURTHER, HEADINGS
from motiongen.runs import SUMMARY_FILE
from motiongen.studies.results import GENERATED
from motiongen.studies.statistics import HIGHER
from motiongen.suggestions import did_you_mean
from motiongen.tracking.summary import LATENCY

DIRECTIONS = ("minimize", "maximize")
RECOGNIZER_ACCURACY = "recognizer_accuracy"
"""Of `task=train_recognizer`: the share of the held-out clips that the recognizer knows."""
KNOWN = (*HEADINGS, *FURTHER, LATENCY, RECOGNIZER_ACCURACY)


class ObjectiveError(InputError):
    """An objective that does not exist, or that a trial did not measure."""


def check_objectives(objectives: Mapping[str, str]) -> None:
    """Raises ObjectiveError unless every objective is a metric with a direction."""
    if not objectives:
        raise ObjectiveError("hydra.sweeper.objectives: there is none; add one, such as {fid: minimize}")
    for name, direction in objectives.items():
        if name not in KNOWN:
            raise ObjectiveError(f"hydra.sweeper.objectives: there is no metric {name!r}{did_you_mean(name, KNOWN)}")
        if direction not in DIRECTIONS:
            better = "maximize" if name in HIGHER else "minimize"
            raise ObjectiveError(
                f"hydra.sweeper.objectives.{name}={direction}: takes {' or '.join(DIRECTIONS)} ({better})"
            )


def measured(folder: Path, objectives: Sequence[str]) -> list[float] | None:
    """The objectives' values in a job's folder; None if the job has not finished.

    Raises:
        ObjectiveError: it has, but one of them is missing or no number.
    """
    path = folder / SUMMARY_FILE
    if not path.is_file():
        return None
    summary = json.loads(path.read_bytes())
    values = []
    for name in objectives:
        try:
            value = _value(summary, name)
        except (KeyError, TypeError) as error:
            raise ObjectiveError(f"{path}: {name} was not measured by this task") from error
        if value is None or not math.isfinite(value):
            raise ObjectiveError(f"{path}: {name} is not a number")
        values.append(float(value))
    return values


def _value(summary: Mapping[str, Any], name: str) -> Any:
    if name == LATENCY:
        return summary[LATENCY]
    if name == RECOGNIZER_ACCURACY:
        return summary["recognizer"]["test_accuracy"]
    return summary["evaluation"]["systems"][GENERATED]["metrics"][name]["mean"]
