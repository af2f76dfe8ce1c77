from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import pytest
from omegaconf import DictConfig, OmegaConf

from motiongen.studies.naming import CHANGES, StudyError
from motiongen.studies.results import study_results
from motiongen.tracking.mlflow import MlflowTracker
from tests.studies.test_rendering import result

FEWER = "data.draws=4"
BOTH = "data.draws=4 recognizer@second_recognizer=st_gcn"


@pytest.fixture
def tracker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> DictConfig:
    monkeypatch.chdir(tmp_path)  # artifacts lie below the working folder
    return OmegaConf.create({"uri": f"sqlite:///{tmp_path / 'mlflow.db'}", "experiment": "tests"})


def record(tracker: DictConfig, study: Path, *trainings: tuple[str, int, str, float]) -> None:
    """A study's runs in MLflow: row, seed, overrides and FID of each."""
    runs = MlflowTracker(**tracker)
    study.mkdir(exist_ok=True)
    runs.start("parts", {}, {}, study)
    for row, seed, changes, fid in trainings:
        folder = study / f"{row}-s{seed}-{changes}"
        folder.mkdir()
        (folder / "summary.json").write_text(json.dumps(asdict(result(fid))))
        child = MlflowTracker(**tracker)
        child.start(folder.name, {}, {"row": row, "seed": str(seed), CHANGES: changes}, folder, study)
        child.log_artifact(folder / "summary.json")
        child.finish()
    runs.finish()


def test_trainings_under_other_overrides_are_not_in_the_same_row(tracker: DictConfig, tmp_path: Path) -> None:
    study = tmp_path / "study"
    record(tracker, study, ("full", 0, "", 1.0), ("full", 1, "", 2.0))
    record(tracker, study, ("full", 1, FEWER, 30.0), ("less", 2, FEWER, 40.0))
    whole = study_results(tracker, "parts", study)
    assert set(whole.rows) == {"full"}
    assert whole.values("full", "fid") == (1.0, 2.0)
    fewer = study_results(tracker, "parts", study, FEWER)
    assert (fewer.values("full", "fid"), fewer.values("less", "fid")) == ((30.0,), (40.0,))
    assert fewer.changes == FEWER


def test_which_trainings_are_meant_has_to_be_said_where_it_is_open(tracker: DictConfig, tmp_path: Path) -> None:
    study = tmp_path / "study"
    record(tracker, study, ("full", 0, BOTH, 1.0))
    assert study_results(tracker, "parts", study).changes == BOTH
    with pytest.raises(StudyError, match=r"no row of parts was run with data\.draws=4;.*\n- data\.draws=4 recognizer@"):
        study_results(tracker, "parts", study, FEWER)
    record(tracker, study, ("full", 1, FEWER, 2.0))
    with pytest.raises(StudyError, match=r"no further overrides;.*\n- data\.draws=4\n- data\.draws=4 recognizer@"):
        study_results(tracker, "parts", study)
