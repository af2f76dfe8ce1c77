"""Long motions of several generators, at `scale=smoke`, in one table."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.tasks.command import motiongen
from tests.tasks.untrained import COMMON, untrained_run

FEW = ["sequences.count=3", "sequences.actions=3", "sequences.confidence=0"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runs")


def test_corrections_of_several_trainings_in_one_table_under_two_recognizers(place: Path) -> None:
    runs = [untrained_run(place / "first", "marionette"), untrained_run(place / "actor", "actor")]
    runs.append(untrained_run(place / "again", "marionette", "seed=3"))
    listed = ",".join(map(str, runs))
    answer = motiongen(
        place,
        *("task=long_motion", f"runs=[{listed}]", "corrections=neural_marionette", "hydra.run.dir=judged"),
        *("recognizer@second_recognizer=gru", *COMMON, *FEW),
    )
    assert answer.returncode == 0, answer.stderr
    summary = json.loads((place / "judged" / "summary.json").read_text())
    corrections = ("pure", "shadow_start", "neural_marionette_without_l2", "neural_marionette")
    of_marionet = [f"marionette-s{seed}, {one}" for seed in (0, 3) for one in corrections]
    for name in ("overall", "sufficient", "second_overall", "second_sufficient"):
        figures = summary[f"{name}_long_motion"]
        assert set(figures) >= {"real", "actor-s0, pure", *of_marionet}
        assert "actor-s0, shadow_start" not in figures
        assert figures["real"]["figures"]["pose_gap"]["value"] >= 0
        assert len(figures["real"]["curves"]["accuracy"]) == 3
        assert (place / "judged" / f"{name}_curves.png").stat().st_size > 10_000
    assert summary["sequences"]["count"] == 3
    assert "actor-s0 is not made with shadow_start: OneShotTransformer does not begin with an embedded pose" in (
        answer.stdout + answer.stderr
    )
    table = (place / "judged" / "overall_long_motion.md").read_text()
    assert "| marionette, neural_marionette " in table
    assert "Sequences: second recognizer, overall" in table


def test_whether_all_seams_are_smoothed_is_part_of_the_protocol(place: Path) -> None:
    run = untrained_run(place / "smooth", "marionette")
    gaps = []
    for smooth in ("false", "true"):
        answer = motiongen(
            place,
            *("task=long_motion", f"runs=[{run}]", f"sequences.smooth={smooth}", f"hydra.run.dir=smooth_{smooth}"),
            *(*COMMON, *FEW),
        )
        assert answer.returncode == 0, answer.stderr
        summary = json.loads((place / f"smooth_{smooth}" / "summary.json").read_text())
        assert summary["sequences"]["smooth"] is (smooth == "true")
        figures = summary["overall_long_motion"]["marionette-s0, pure"]["figures"]
        gaps.append(figures["velocity_gap"]["value"])
    assert gaps[1] < gaps[0]


def test_a_wrong_kind_of_sequences_is_told(place: Path) -> None:
    run = untrained_run(place / "lonely", "marionette")
    answer = motiongen(place, "task=long_motion", f"runs=[{run}]", "sequences.kinds=[overal]", *COMMON)
    assert answer.returncode == 1
    assert "sequences.kinds: there is no kind 'overal'; did you mean 'overall'" in answer.stderr
