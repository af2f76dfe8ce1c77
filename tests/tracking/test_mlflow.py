from __future__ import annotations

import json
import math
import multiprocessing
from pathlib import Path

import pytest
from mlflow import MlflowClient
from mlflow.artifacts import download_artifacts
from mlflow.entities import Run

from motiongen.tracking.mlflow import MlflowTracker, flattened
from motiongen.tracking.none import NoTracker
from motiongen.tracking.tracker import Tracker


@pytest.fixture
def uri(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)  # artifacts lie below the working folder
    return f"sqlite:///{tmp_path / 'mlflow.db'}"


def only_run(uri: str) -> Run:
    client = MlflowClient(uri)
    experiment = client.get_experiment_by_name("tests")
    assert experiment is not None
    (run,) = client.search_runs([experiment.experiment_id])
    return run


def tracker(uri: str) -> MlflowTracker:
    return MlflowTracker(uri=uri, experiment="tests")


def test_a_run_holds_all_that_was_logged(uri: str, tmp_path: Path) -> None:
    kept = tracker(uri)
    kept.start("named", {"generator": {"width": 8, "long": "x" * 400}}, {"generator/encoder": "y"}, tmp_path)
    for step in range(3):
        kept.log_metrics({"loss": 1.0 / (step + 1), "odd": math.nan}, step)
    kept.log_metrics({"fid": 2.5, "marionette-data.draws=5-s0/fid": 3.5})
    kept.log_data("bandai", "ab" * 32, {"tags": ["walk"], "train_clips": 4})
    kept.log_table("actions_marionette-data.draws=5-s0", [{"action": "walk"}])
    kept.log_table("metrics", [{"system": "real", "fid": 0.1}, {"system": "generated", "fid": 2.5}])
    (tmp_path / "page.html").write_text("<p>moves</p>")
    kept.log_artifact(tmp_path / "page.html", "previews")
    kept.finish()

    run = only_run(uri)
    assert run.info.run_name == "named"
    assert run.info.status == "FINISHED"
    assert run.data.params["generator.width"] == "8"
    assert run.data.params["generator.long"] == "x" * 250
    assert run.data.tags["generator/encoder"] == "y"
    (used,) = run.inputs.dataset_inputs
    assert (used.dataset.name, used.dataset.digest) == ("bandai", "ab" * 18)
    assert json.loads(used.dataset.source) == {"fingerprint": "ab" * 32}
    assert json.loads(used.dataset.profile) == {"tags": ["walk"], "train_clips": 4}
    assert run.data.metrics["fid"] == 2.5
    assert run.data.metrics["marionette-data.draws:5-s0/fid"] == 3.5
    history = MlflowClient(uri).get_metric_history(run.info.run_id, "loss")
    assert [(metric.step, metric.value) for metric in history] == [(0, 1.0), (1, 0.5), (2, pytest.approx(1 / 3))]

    folder = Path(download_artifacts(run_id=run.info.run_id, tracking_uri=uri, dst_path=str(tmp_path / "got")))
    assert (folder / "previews" / "page.html").read_text() == "<p>moves</p>"
    assert json.loads((folder / "metrics.json").read_text())["columns"] == ["system", "fid"]
    assert "x" * 400 in (folder / "config.yaml").read_text()


def test_an_interrupted_run_goes_on_under_its_id(uri: str, tmp_path: Path) -> None:
    first = tracker(uri)
    first.start("named", {"a": 1}, {}, tmp_path)
    first.log_metrics({"loss": 1.0}, 0)
    assert only_run(uri).info.status == "RUNNING"
    second = tracker(uri)
    second.start("named", {"a": 1}, {}, tmp_path)
    second.log_metrics({"loss": 0.5}, 1)
    second.finish()
    run = only_run(uri)
    assert run.info.status == "FINISHED"
    assert run.data.metrics["loss"] == 0.5


def test_a_run_that_the_database_does_not_know_begins_anew(uri: str, tmp_path: Path) -> None:
    (tmp_path / "mlflow_run_id").write_text("0" * 32)
    kept = tracker(uri)
    kept.start("named", {}, {}, tmp_path)
    kept.finish("FAILED")
    assert only_run(uri).info.status == "FAILED"


def _log_one(uri: str, name: str) -> None:
    kept = tracker(uri)
    kept.start(name, {"a": 1}, {})
    for step in range(20):
        kept.log_metrics({"loss": float(step)}, step)
    kept.finish()


def test_processes_that_begin_together_share_one_new_database(uri: str) -> None:
    context = multiprocessing.get_context("spawn")
    processes = [context.Process(target=_log_one, args=(uri, f"run {index}")) for index in range(3)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(timeout=300)
    assert [process.exitcode for process in processes] == [0, 0, 0]
    client = MlflowClient(uri)
    experiment = client.get_experiment_by_name("tests")
    assert experiment is not None
    runs = client.search_runs([experiment.experiment_id])
    assert sorted(run.info.run_name for run in runs) == ["run 0", "run 1", "run 2"]
    assert all(len(client.get_metric_history(run.info.run_id, "loss")) == 20 for run in runs)


def test_nested_configuration_becomes_flat() -> None:
    assert flattened({"a": {"b": {"c": 1}, "d": None}, "e": [1, 2]}) == {"a.b.c": "1", "a.d": "None", "e": "[1, 2]"}


def test_no_tracker_keeps_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    kept: Tracker = NoTracker()
    kept.start("named", {"a": 1}, {}, tmp_path)
    kept.log_metrics({"loss": 1.0}, 0)
    kept.log_table("t", [{"a": 1}])
    kept.finish()
    assert list(tmp_path.iterdir()) == []
    assert kept.how_to_open() == ""
