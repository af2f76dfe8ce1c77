"""Results of earlier runs in one table, where they were measured alike; where they were not, what differs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from motiongen.documents import DocumentError, read_json
from motiongen.errors import InputError
from motiongen.evaluation.results import REAL, Estimate
from motiongen.evaluation.table import HEADINGS, estimate_text
from motiongen.files import is_file
from motiongen.runs import SUMMARY_FILE
from motiongen.schemas import problem_in

UNTRAINED = "untrained"
DECIDES = ("protocol", "data_fingerprint", "recognizer", "count")
"""What has to be equal for two results to compare."""

FIGURE = {"type": ["number", "null"], "minimum": -1e300, "maximum": 1e300}
"""A number as every table can show it; null for what could not be measured"""
ESTIMATES = {
    "type": "object",
    "additionalProperties": {
        "type": "object",
        "required": ["mean"],
        "properties": {"mean": FIGURE, "interval": FIGURE},
    },
}
LENGTH = {
    "type": "object",
    "required": ["frames", "same_length", "metrics"],
    "properties": {
        "frames": {"type": "integer", "minimum": 1, "maximum": 10**6},
        "same_length": {"type": "boolean"},
        "metrics": ESTIMATES,
    },
}
SYSTEM = {
    "type": "object",
    "required": ["metrics", "count"],
    "properties": {
        "metrics": ESTIMATES | {"required": list(HEADINGS)},
        "count": {"type": "integer"},
        "lengths": {"type": "array", "items": LENGTH},
    },
}
RECOGNIZER: dict[str, Any] = {
    "type": "object",
    "required": ["name", "fingerprint"],
    "properties": {
        "name": {"type": "string"},
        "fingerprint": {"type": "string"},
        "test_accuracy": {"type": "number", "minimum": 0, "maximum": 1},
    },
}
EVALUATION: dict[str, Any] = {
    "type": "object",
    "required": [*DECIDES, "systems"],
    "properties": {
        "protocol": {"type": "object"},
        "data_fingerprint": {"type": "string"},
        "recognizer": RECOGNIZER,
        "count": {"type": "integer"},
        "seeds": {"type": "array"},
        "systems": {"type": "object", "additionalProperties": SYSTEM},
    },
}
RESULT = {
    "type": "object",
    "required": ["name", "evaluation"],
    "properties": {
        "name": {"type": "string"},
        "evaluation": EVALUATION,
        "second_evaluation": EVALUATION | {"type": ["object", "null"]},
        "latents": {"type": ["object", "null"], "additionalProperties": FIGURE | {"type": "number"}},
    },
}
"""JSON schema of what is read of a run's summary"""


@dataclass(frozen=True)
class StoredResult:
    """What one run measured."""

    name: str
    evaluation: Mapping[str, Any]
    """As `Evaluation.to_json` gave it"""
    second_evaluation: Mapping[str, Any] | None = None
    """The same motions before a second recognizer, if there was one"""
    latents: Mapping[str, float] | None = None
    """As `LatentSpace.figures` gave it; None for generators without codes"""

    def differences(self, other: StoredResult) -> list[str]:
        """Why the two do not compare: `protocol.seeds: 5 and 20`; nothing where they do."""
        return [
            f"{field}: {_short(self.evaluation, path)} and {_short(other.evaluation, path)}"
            for field, path in _fields(self.evaluation, other.evaluation)
            if _at(self.evaluation, path) != _at(other.evaluation, path)
        ]


def read_result(folder: Path) -> StoredResult:
    """The result in a run's folder.

    Raises:
        InputError: there is none, or it is damaged; the message names the file and the field.
    """
    path = folder / SUMMARY_FILE
    summary = read_summary(folder)
    if problem := problem_in(summary, RESULT):
        raise InputError(f"results: {path}: {problem}; the run measured nothing, or long ago, or the file is damaged")
    return StoredResult(
        summary["name"], summary["evaluation"], summary.get("second_evaluation"), summary.get("latents")
    )


def read_summary(folder: Path) -> dict[str, Any]:
    """What the run in this folder found.

    Raises:
        InputError: there is nothing, or it is damaged.
    """
    path = folder / SUMMARY_FILE
    if not is_file(path):
        raise InputError(f"results: {path}: no such file; has the run finished?")
    try:
        summary = read_json(path)
    except DocumentError as error:
        raise InputError(f"results: {path}: not a summary of a run: {error}") from error
    if not isinstance(summary, dict):
        raise InputError(f"results: {path}: not a summary of a run: {type(summary).__name__}")
    return summary


def alike(results: Iterable[StoredResult]) -> list[list[StoredResult]]:
    """Groups of results that compare, in the order in which they were given."""
    groups: list[list[StoredResult]] = []
    for result in results:
        for group in groups:
            if not group[0].differences(result):
                group.append(result)
                break
        else:
            groups.append([result])
    return groups


def result_rows(group: Iterable[StoredResult]) -> list[dict[str, str]]:
    """One row for the real clips, and one for every run's systems; the untrained network stays out."""
    rows: list[dict[str, str]] = []
    for result in group:
        systems = result.evaluation["systems"]
        for name, system in systems.items():
            if name == UNTRAINED or (name == REAL and rows):
                continue
            label = name if name == REAL else result.name if len(systems) <= 3 else f"{result.name}: {name}"
            row = {"run": label}
            for metric, (heading, decimals) in HEADINGS.items():
                row[heading] = estimate_text(_estimate(system["metrics"][metric]), decimals)
                if metric == "fid":
                    row["N"] = str(system["count"])
            rows.append(row)
    return rows


def _estimate(stored: Mapping[str, float | None]) -> Estimate:
    mean, interval = stored["mean"], stored.get("interval")
    return Estimate(math.nan if mean is None else mean, math.nan if interval is None else interval)


def _fields(one: Mapping[str, Any], other: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str, ...]]]:
    for field in DECIDES:
        if isinstance(one[field], dict) and isinstance(other[field], dict):
            for key in dict.fromkeys((*one[field], *other[field])):
                yield f"{field}.{key}", (field, key)
        else:
            yield field, (field,)


def _at(evaluation: Mapping[str, Any], path: tuple[str, ...]) -> Any:
    value: Any = evaluation
    for key in path:
        value = value.get(key)
    return value


def _short(evaluation: Mapping[str, Any], path: tuple[str, ...]) -> str:
    value = _at(evaluation, path)
    return value[:12] if path[-1].endswith("fingerprint") and isinstance(value, str) else f"{value!s:.200}"
