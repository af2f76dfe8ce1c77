"""Runs side by side, at `scale=smoke`, and what cannot be compared."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from motiongen.configuration import compose
from motiongen.tasks.assembly import build_data
from tests.tasks.command import motiongen
from tests.tasks.untrained import COMMON, untrained_run


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runs")


def test_runs_of_several_systems_in_one_table_under_two_recognizers(place: Path) -> None:
    runs = [untrained_run(place / name, name) for name in ("marionette", "actor")]
    runs.append(untrained_run(place / "again", "marionette", "seed=3"))
    listed = ",".join(map(str, runs))
    answer = motiongen(
        place, "task=compare", f"runs=[{listed}]", "recognizer@second_recognizer=gru", "hydra.run.dir=compared", *COMMON
    )
    assert answer.returncode == 0, answer.stderr
    summary = json.loads((place / "compared" / "summary.json").read_text())
    for key, name in (("evaluation", "TransformerRecognizer"), ("second_evaluation", "GRURecognizer")):
        assert list(summary[key]["systems"]) == ["real", "marionette-s0", "actor-s0", "marionette-s3"]
        assert summary[key]["recognizer"]["name"] == name
    assert set(summary["evaluation"]["systems"]["actor-s0"]["differences"]) >= {"accuracy", "fid"}
    rows = [line for line in answer.stdout.splitlines() if line.startswith("| marionette ")]
    assert rows
    assert all(row.split("|")[2].strip() == "2" for row in rows)
    assert "Paired differences from marionette-s0" in answer.stdout
    assert "two recognizers" in answer.stdout or "They disagree about:" in answer.stdout


def test_a_run_that_saw_the_test_clips_is_refused(place: Path) -> None:
    other = untrained_run(place / "other_split", "marionette", "data.split_seed=7")
    answer = motiongen(place, "task=compare", f"runs=[{other}]", *COMMON)
    assert answer.returncode == 1
    assert "are a test clip, but the generator was trained on frames" in answer.stderr


def test_a_folder_without_a_run_is_refused(place: Path) -> None:
    (place / "empty").mkdir()
    answer = motiongen(place, "task=compare", "runs=[empty]", *COMMON)
    assert answer.returncode == 1
    assert "empty is not the folder of a run" in answer.stderr


def test_motions_of_others_are_judged_by_the_same_protocol(place: Path) -> None:
    """Training clips of the data, written as files, on their own body."""
    data = build_data(compose([*COMMON, f"cache={place / 'cache'}"]))
    folder = place / "motions"
    folder.mkdir()
    lines = ["file,tags"]
    for number, clip in enumerate(data.split.train[:20]):
        tags = data.store.sequences[clip.sequence].segments[clip.segment].tags
        np.savez(folder / f"{number}.npz", features=data.store.features(clip.sequence, clip.start - 6, clip.stop))
        lines.append(f"{number}.npz,{'+'.join(tags)}")
    (folder / "labels.csv").write_text("\n".join(lines))
    answer = motiongen(place, "task=evaluate", "motions=motions", "hydra.run.dir=judged", *COMMON)
    assert answer.returncode == 0, answer.stderr
    systems = json.loads((place / "judged" / "summary.json").read_text())["evaluation"]["systems"]
    assert list(systems) == ["real", "motions"]
    assert systems["motions"]["metrics"]["nearest_training_distance"]["mean"] == pytest.approx(0.0, abs=1e-3)
    assert systems["motions"]["metrics"]["trajectory_error"]["mean"] is None
    refused = motiongen(place, "task=evaluate", *COMMON)
    assert "run or motions must be given: run=... or motions=..." in refused.stderr
