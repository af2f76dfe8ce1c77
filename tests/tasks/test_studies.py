"""Studies and searches as users type them, at `scale=smoke`."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from mlflow import MlflowClient

from tests.tasks.command import motiongen

SMALL = ["scale=smoke", "data.source.sessions=8", "data.min_clips=2", "evaluation.seeds=1", "trainer.max_epochs=6"]
STUDY = ["-m", "+ablation/marionet_next_tag=glob(*)", "seed=0", *SMALL]
SECONDS_TO_WAIT = 300


def killed_when(place: Path, file: str, *arguments: str) -> None:
    """Starts a command, and kills it and all its processes as soon as a file of that pattern is there."""
    process = subprocess.Popen(
        [sys.executable, "-m", "motiongen", *arguments, f"cache={place / 'cache'}"],
        cwd=place,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    until = time.monotonic() + SECONDS_TO_WAIT
    while not list(place.glob(file)):
        assert process.poll() is None, "it ended before it could be killed"
        assert time.monotonic() < until
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@pytest.mark.skipif(sys.platform == "win32", reason="kills a process group")
def test_a_study_that_was_killed_goes_on_and_becomes_a_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "runs" / "studies" / "marionet_next_tag" / "builtin-smoke"
    killed_when(tmp_path, "runs/studies/*/*/without_next_tag*/checkpoints/last.ckpt", *STUDY)
    first, second = sorted(path for path in folder.iterdir() if path.is_dir())
    assert (first / "summary.json").is_file()
    assert not (second / "summary.json").is_file()
    before = (first / "summary.json").read_text()

    again = motiongen(tmp_path, *STUDY)
    assert again.returncode == 0, again.stderr
    assert f"{first.name}: done before under the same configuration, data and code; reused" in again.stdout
    assert f"{second.name}: goes on from its last checkpoint" in again.stdout
    assert "2 rows and seeds done" in again.stdout
    assert (first / "summary.json").read_text() == before

    report = motiongen(tmp_path, "task=report", "study=marionet_next_tag", "scale=smoke")
    assert report.returncode == 0, report.stderr
    assert "| with next tag " in report.stdout
    assert all((folder / f"report.{ending}").is_file() for ending in ("md", "csv", "tex", "html", "png"))

    monkeypatch.chdir(tmp_path)
    client = MlflowClient("sqlite:///mlflow.db")
    runs = client.search_runs([client.get_experiment_by_name("motiongen").experiment_id])
    (parent,) = [run for run in runs if "mlflow.parentRunId" not in run.data.tags]
    children = [run for run in runs if run is not parent]
    assert {run.data.tags["row"] for run in children} == {"with_next_tag", "without_next_tag"}
    assert len(children) == 2, "no row is there twice"
    assert {run.data.tags["mlflow.parentRunId"] for run in children} == {parent.info.run_id}
    assert {run.info.status for run in runs} == {"FINISHED"}
    assert "report.md" in {file.path for file in client.list_artifacts(parent.info.run_id)}

    # Long motion of the trainings, as a study of its own.
    judging = ["-m", "+ablation/long_motion_next_tag=glob(*)", *STUDY[2:], "sequences.count=2", "sequences.actions=3"]
    judged = motiongen(tmp_path, *judging, "sequences.confidence=0")
    assert judged.returncode == 0, judged.stderr
    assert "2 rows and seeds done" in judged.stdout
    report = motiongen(tmp_path, "task=report", "study=long_motion_next_tag", "scale=smoke")
    assert report.returncode == 0, report.stderr
    assert "accuracy, sufficient, paper" in report.stdout
    assert "2 sequences of 3 actions, overall and sufficient" in report.stdout
    places = folder.parents[1] / "long_motion_next_tag" / "builtin-smoke" / "report_places"
    assert places.with_suffix(".png").stat().st_size > 10_000
    assert len(places.with_suffix(".csv").read_text().splitlines()) > 3 * 4


def test_a_row_that_fails_stops_no_other_and_ends_with_an_error(tmp_path: Path) -> None:
    line = ["-m", "+ablation/actor_variable_length=variable,fixed", "seed=0", "tracker=none", *SMALL]
    answer = motiongen(tmp_path, *line)
    assert answer.returncode == 1
    assert "1 rows and seeds done" in answer.stdout
    assert "generator.pt" in answer.stdout, "`variable` starts from `fixed`, which has not run yet"
    assert "1 rows failed; the same command with retry_failed=true runs them again" in answer.stderr
    assert "Traceback" not in answer.stderr
    again = motiongen(tmp_path, *line, "retry_failed=true")
    assert again.returncode == 0, again.stderr
    assert "2 rows and seeds done" in again.stdout


def test_a_search_goes_on_where_it_stopped(tmp_path: Path) -> None:
    line = ["-m", "+experiment=actor", "hydra/sweeper=search", "hydra.sweeper.name=test", "data.validation_share=0.3"]
    line += ["optimizer.optimizer.lr=tag(log,interval(1e-4,1e-2))", *SMALL]
    first = motiongen(tmp_path, *line, "hydra.sweeper.trials=1")
    assert first.returncode == 0, first.stderr
    assert "1 trials finished" in first.stdout
    more = motiongen(tmp_path, *line, "hydra.sweeper.trials=2")
    assert more.returncode == 0, more.stderr
    assert "2 trials finished" in more.stdout
    assert "The best on the held-out clips, by fid (minimize):" in more.stdout
    folder = tmp_path / "runs" / "search" / "test"
    assert {path.name for path in folder.glob("trial-*")} == {"trial-0000", "trial-0001"}
    assert len((folder / "trials.csv").read_text().splitlines()) == 3


def test_the_settings_of_a_recognizer_are_chosen_on_held_out_clips(tmp_path: Path) -> None:
    line = ["-m", "task=train_recognizer", "+search=recognizer", "recognizer=gru", "hydra.sweeper.trials=2", *SMALL]
    done = motiongen(tmp_path, *line)
    assert done.returncode == 0, done.stderr
    assert "The best on the held-out clips, by recognizer_accuracy (maximize):" in done.stdout
    summaries = sorted((tmp_path / "runs" / "search" / "recognizer_gru").glob("trial-*/summary.json"))
    found = [json.loads(path.read_bytes())["recognizer"]["test_accuracy"] for path in summaries]
    rows = (tmp_path / "runs" / "search" / "recognizer_gru" / "trials.csv").read_text().splitlines()[1:]
    assert [float(row.split(",")[2]) for row in rows] == found


def test_a_search_names_what_is_wrong_before_it_trains(tmp_path: Path) -> None:
    line = ["-m", "+experiment=actor", "hydra/sweeper=search", "hydra.sweeper.name=test", "tracker=none", *SMALL]
    nothing = motiongen(tmp_path, *line)
    assert nothing.returncode == 1
    assert "motiongen: hydra.sweeper.space: there is nothing to search" in nothing.stderr
    typo = motiongen(tmp_path, *line, "seed=choice(0,1)", "+hydra.sweeper.objectives.fidd=minimize")
    assert typo.returncode == 1
    assert "no metric 'fidd'; did you mean 'fid'" in typo.stderr
    assert "Traceback" not in typo.stderr
