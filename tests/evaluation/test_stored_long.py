from __future__ import annotations

from typing import Any

import pytest

from motiongen.errors import InputError
from motiongen.evaluation.long_results import COLUMNS
from motiongen.evaluation.stored_long import long_result


def figures(value: float) -> dict[str, Any]:
    return {
        "figures": {figure: {"value": value} for figure in COLUMNS},
        "curves": {figure: [value, None, 2 * value] for figure in COLUMNS},
    }


def summary(*systems: str) -> dict[str, Any]:
    found = {"real": figures(1.0)} | {system: figures(0.5) for system in systems}
    return {
        "name": "row-s0",
        "data": {"fingerprint": "d" * 64},
        "sequences": {"kinds": ["overall", "sufficient"], "count": 3, "actions": 3},
        "recognizers": [{"name": "Judge", "fingerprint": "f" * 64, "test_accuracy": 0.9}],
        "overall_long_motion": found,
        "sufficient_long_motion": found,
    }


def test_the_system_that_was_judged_is_the_generated_one() -> None:
    result = long_result(summary("marionette-s0, pure"))
    generated = result.evaluation["systems"]["generated"]
    assert generated["metrics"]["sufficient_pose_gap"] == {"mean": 0.5}
    assert generated["places"]["overall_accuracy"] == [0.5, None, 1.0]
    assert result.evaluation["systems"]["real"]["metrics"]["overall_fid"] == {"mean": 1.0}
    assert set(generated["metrics"]) == {f"{kind}_{figure}" for kind in ("overall", "sufficient") for figure in COLUMNS}


def test_a_second_recognizer_s_figures_are_read_beside() -> None:
    twice = summary("a, pure")
    assert long_result(twice).second_evaluation is None
    twice["recognizers"] = [*twice["recognizers"], {**twice["recognizers"][0], "name": "Other"}]
    with pytest.raises(InputError, match="field 'second_overall_long_motion' is missing"):
        long_result(twice)
    for kind in ("overall", "sufficient"):
        twice[f"second_{kind}_long_motion"] = {"real": figures(1.0), "a, pure": figures(0.25)}
    second = long_result(twice).second_evaluation
    assert second is not None
    assert second["recognizer"]["name"] == "Other"
    assert second["systems"]["generated"]["metrics"]["overall_accuracy"] == {"mean": 0.25}
    assert long_result(twice).evaluation["systems"]["generated"]["metrics"]["overall_accuracy"] == {"mean": 0.5}


@pytest.mark.parametrize(
    ("systems", "told"), [((), "not none"), (("a, pure", "a, shadow_start"), "not a, pure, a, shad")]
)
def test_a_row_is_one_system(systems: tuple[str, ...], told: str) -> None:
    with pytest.raises(InputError, match=f"row-s0: a row judges one run with one correction, {told}"):
        long_result(summary(*systems))


def test_a_field_that_is_missing_is_named() -> None:
    broken = summary("a, pure")
    del broken["recognizers"]
    with pytest.raises(InputError, match="field 'recognizers' is missing"):
        long_result(broken)
