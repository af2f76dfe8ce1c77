"""Results of long motion in the form in which those of single actions are stored, so that a study can hold either."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from motiongen.errors import InputError
from motiongen.evaluation.long_results import COLUMNS, PREFIXES
from motiongen.evaluation.results import REAL
from motiongen.evaluation.sequences import KINDS
from motiongen.evaluation.stored import FIGURE, RECOGNIZER, StoredResult
from motiongen.runs import SUMMARY_FILE
from motiongen.schemas import problem_in

LONG_HEADINGS = {
    f"{kind}_{figure}": (f"{heading}, {kind}", decimals)
    for kind in KINDS
    for figure, (heading, decimals) in COLUMNS.items()
}
"""Metrics of long motion, such as "overall_accuracy", with what HEADINGS holds of others."""

CURVE = {"type": "array", "items": FIGURE}
LONG_SYSTEM = {
    "type": "object",
    "required": ["figures", "curves"],
    "properties": {
        "figures": {
            "type": "object",
            "required": list(COLUMNS),
            "additionalProperties": {"type": "object", "required": ["value"], "properties": {"value": FIGURE}},
        },
        "curves": {"type": "object", "required": list(COLUMNS), "additionalProperties": CURVE},
    },
}
LONG_RESULT = {
    "type": "object",
    "required": ["name", "data", "sequences", "recognizers"],
    "properties": {
        "name": {"type": "string"},
        "data": {
            "type": "object",
            "required": ["fingerprint"],
            "properties": {"fingerprint": {"type": "string"}},
        },
        "sequences": {
            "type": "object",
            "required": ["kinds", "count", "actions"],
            "properties": {
                "kinds": {"type": "array", "minItems": 1, "items": {"enum": list(KINDS)}},
                "count": {"type": "integer"},
                "actions": {"type": "integer"},
            },
        },
        "recognizers": {
            "type": "array",
            "minItems": 1,
            "items": RECOGNIZER | {"required": list(RECOGNIZER["properties"])},
        },
        **{
            f"{prefix}{kind}_long_motion": {"type": "object", "required": [REAL], "additionalProperties": LONG_SYSTEM}
            for prefix in PREFIXES
            for kind in KINDS
        },
    },
}
"""JSON schema of what is read of the summary of long motion"""


def long_result(summary: Mapping[str, Any]) -> StoredResult:
    """The result in the summary of `task=long_motion` with one run and one correction.

    Raises:
        InputError: it judged more than one system, or none; or a field is missing or wrong.
    """
    if problem := problem_in(summary, LONG_RESULT):
        raise InputError(f"results: {SUMMARY_FILE}: {problem}; it is not that of a long motion, or damaged")
    evaluation = _evaluation(summary, PREFIXES[0], summary["recognizers"][0])
    second = None
    if len(summary["recognizers"]) > 1:
        second = _evaluation(summary, PREFIXES[1], summary["recognizers"][1])
    return StoredResult(summary["name"], evaluation, second)


def _evaluation(summary: Mapping[str, Any], prefix: str, recognizer: Mapping[str, Any]) -> dict[str, Any]:
    name, sequences = summary["name"], summary["sequences"]
    systems: dict[str, dict[str, dict[str, Any]]] = {
        "generated": {"metrics": {}, "places": {}},
        REAL: {"metrics": {}, "places": {}},
    }
    for kind in sequences["kinds"]:
        field = f"{prefix}{kind}_long_motion"
        if field not in summary:
            raise InputError(f"results: {SUMMARY_FILE}: field {field!r} is missing; it is not that of a long motion")
        found = summary[field]
        judged = [system for system in found if system != REAL]
        if len(judged) != 1:
            told = ", ".join(judged) or "none: the run cannot be made with it"
            raise InputError(
                f"results: {SUMMARY_FILE}: {name:.200}: a row judges one run with one correction, not {told:.500}"
            )
        for system, own in (("generated", found[judged[0]]), (REAL, found[REAL])):
            for figure in COLUMNS:
                if len(own["curves"][figure]) != sequences["actions"]:
                    raise InputError(
                        f"results: {SUMMARY_FILE}: {field}: {system}: the curve of {figure} has "
                        f"{len(own['curves'][figure])} places, not {sequences['actions']}"
                    )
                systems[system]["metrics"][f"{kind}_{figure}"] = {"mean": own["figures"][figure]["value"]}
                systems[system]["places"][f"{kind}_{figure}"] = own["curves"][figure]
    return {
        "protocol": sequences,
        "count": sequences["count"],
        "data_fingerprint": summary["data"]["fingerprint"],
        "recognizer": recognizer,
        "systems": systems,
    }
