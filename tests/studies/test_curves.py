from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import pytest

from motiongen.evaluation.results import REAL
from motiongen.evaluation.stored import StoredResult
from motiongen.studies.curves import curves_csv, draw_curves, length_curves, place_curves
from motiongen.studies.results import StudyResults
from motiongen.studies.statistics import over_trainings

FRAMES = (40, 60, 100)


def at_lengths(**metrics: list[float | None]) -> list[dict[str, Any]]:
    return [
        {
            "frames": frames,
            "same_length": frames < 100,
            "count": 9,
            "metrics": {name: {"mean": own[number]} for name, own in metrics.items()},
        }
        for number, frames in enumerate(FRAMES)
    ]


def training(*fids: float) -> StoredResult:
    generated = {"lengths": at_lengths(accuracy=[0.5, 0.6, 0.4], fid=list(fids))}
    return StoredResult(
        "run", {"systems": {"generated": generated, REAL: {"lengths": at_lengths(accuracy=[0.9, 0.8, None])}}}
    )


ROWS = {"steady": (training(1.0, 1.2, 1.4), training(1.2, 1.2, 2.0)), "drifting": (training(2.0, 4.0, 9.0),)}
RESULTS = StudyResults("length", "id", ROWS, ())


def test_a_line_a_row_with_its_interval_over_trainings() -> None:
    curves = length_curves(RESULTS)
    assert curves is not None
    assert curves.lines["steady"]["fid"] == {
        40: over_trainings([1.0, 1.2]),
        60: over_trainings([1.2, 1.2]),
        100: over_trainings([1.4, 2.0]),
    }
    assert [point.value for point in curves.lines["drifting"]["fid"].values()] == [2.0, 4.0, 9.0]
    assert list(curves.lines[REAL]["accuracy"]) == [40, 60]
    assert curves.lines[REAL]["fid"] == {}
    assert curves.set_apart == {100}


def test_every_point_is_in_the_file_and_the_picture_is_drawn(tmp_path: Path) -> None:
    curves = length_curves(RESULTS)
    assert curves is not None
    rows = list(csv.DictReader(io.StringIO(curves_csv(curves))))
    assert len(rows) == 2 + 2 * 6
    found = next(row for row in rows if (row["row"], row["metric"], row[curves.axis]) == ("steady", "fid", "100"))
    assert float(found["mean"]) == pytest.approx(1.7)
    draw_curves(tmp_path / "curves.png", curves)
    assert (tmp_path / "curves.png").stat().st_size > 10_000


def test_a_study_without_lengths_and_places_has_no_such_curves() -> None:
    plain = StoredResult("run", {"systems": {"generated": {}, REAL: {}}})
    results = StudyResults("parts", "id", {"row": (plain,)}, ())
    assert length_curves(results) is None
    assert place_curves(results, ["fid"]) is None


def test_long_motion_is_drawn_along_the_sequence(tmp_path: Path) -> None:
    def judged(*accuracies: float | None) -> StoredResult:
        systems = {name: {"places": {"overall_accuracy": list(accuracies)}} for name in ("generated", REAL)}
        return StoredResult("run", {"systems": systems})

    rows = {"marionet": (judged(0.9, 0.8, None), judged(0.7, 0.8, None))}
    curves = place_curves(StudyResults("schemes", "id", rows, ()), ["overall_accuracy"])
    assert curves is not None
    assert curves.headings == {"overall_accuracy": "accuracy, overall"}
    assert curves.lines["marionet"]["overall_accuracy"] == {
        1: over_trainings([0.9, 0.7]),
        2: over_trainings([0.8, 0.8]),
    }
    assert curves.lines[REAL]["overall_accuracy"][1].value == 0.9
    draw_curves(tmp_path / "places.png", curves)
    assert (tmp_path / "places.png").stat().st_size > 5_000
