"""What a trial measured, read from the folder that its job left behind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from motiongen.errors import InputError
from motiongen.evaluation.stored import read_summary
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
PLACES = {LATENCY: (LATENCY,), RECOGNIZER_ACCURACY: ("recognizer", "test_accuracy")}
"""Where a summary has what is not a metric of the generated motion."""
LARGEST = 1e300
"""Beyond it, what a storage computes of values is not finite."""


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
    try:
        summary = read_summary(folder)
    except InputError as error:
        raise ObjectiveError(str(error)) from error
    values = []
    for name in objectives:
        value: Any = summary
        for key in PLACES.get(name, ("evaluation", "systems", GENERATED, "metrics", name, "mean")):
            if not isinstance(value, dict) or key not in value:
                raise ObjectiveError(f"{path}: {name} was not measured by this task")
            value = value[key]
        if type(value) not in (int, float) or not abs(value) <= LARGEST:
            raise ObjectiveError(f"{path}: {name} is not a number")
        values.append(float(value))
    return values
