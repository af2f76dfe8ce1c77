"""Results of long motion in the form in which those of single actions are stored, so that a study can hold either."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from motiongen.errors import InputError
from motiongen.evaluation.long_results import COLUMNS
from motiongen.evaluation.results import REAL
from motiongen.evaluation.sequences import KINDS
from motiongen.evaluation.stored import StoredResult

LONG_HEADINGS = {
    f"{kind}_{figure}": (f"{heading}, {kind}", decimals)
    for kind in KINDS
    for figure, (heading, decimals) in COLUMNS.items()
}
"""Metrics of long motion, such as "overall_accuracy", with what HEADINGS holds of others."""


def long_result(summary: Mapping[str, Any]) -> StoredResult:
    """The result in the summary of `task=long_motion` with one run and one correction.

    Raises:
        InputError: it judged more than one system, or none; or a field is missing.
    """
    try:
        name = str(summary["name"])
        kinds = {kind: summary[f"{kind}_long_motion"] for kind in summary["sequences"]["kinds"]}
        systems: dict[str, dict[str, dict[str, Any]]] = {
            "generated": {"metrics": {}, "places": {}},
            REAL: {"metrics": {}, "places": {}},
        }
        for kind, found in kinds.items():
            judged = [system for system in found if system != REAL]
            if len(judged) != 1:
                told = ", ".join(judged) or "none: the run cannot be made with it"
                raise InputError(f"{name}: a row judges one run with one correction, not {told}")
            for system, own in (("generated", found[judged[0]]), (REAL, found[REAL])):
                for figure in COLUMNS:
                    systems[system]["metrics"][f"{kind}_{figure}"] = {"mean": own["figures"][figure]["value"]}
                    systems[system]["places"][f"{kind}_{figure}"] = own["curves"][figure]
        evaluation = {
            "protocol": summary["sequences"],
            "count": summary["sequences"]["count"],
            "data_fingerprint": summary["data"]["fingerprint"],
            "recognizer": summary["recognizers"][0],
            "systems": systems,
        }
    except KeyError as error:
        raise InputError(f"results: summary.json: field {error} is missing; it is not that of a long motion") from error
    return StoredResult(name, evaluation)
