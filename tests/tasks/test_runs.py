"""Whole runs of the command line at `scale=smoke`: repeated, killed and resumed, evaluated again, synthesized from."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import mlflow
import numpy as np
import pytest
import torch

from motiongen.motion.kinematics import joint_positions
from motiongen.motion.skeleton import Skeleton
from motiongen.tracking.mlflow import RUN_ID_FILE

EPOCHS = 12
COMMON = ["scale=smoke", "data.source.sessions=16", "evaluation.seeds=2"]
TRAIN = ["+experiment=marionette", f"trainer.max_epochs={EPOCHS}", *COMMON]


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("runs")


def start(place: Path, *arguments: str) -> subprocess.Popen[str]:
    environment = os.environ | {"MOTIONGEN_CACHE": str(place / "cache"), "OMP_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, "-m", "motiongen", *arguments],
        cwd=place,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def finish(process: subprocess.Popen[str]) -> str:
    output, _ = process.communicate(timeout=300)
    assert process.returncode == 0, output
    return output


def figures(folder: Path) -> dict:
    return json.loads((folder / "summary.json").read_text())["evaluation"]


@pytest.fixture(scope="module")
def trained(place) -> tuple[Path, str]:
    """A run that nothing disturbed, and what it printed."""
    output = finish(start(place, *TRAIN, f"hydra.run.dir={place / 'whole'}"))
    return place / "whole", output


def test_says_where_everything_lies(trained, place):
    folder, output = trained
    assert f"Watch the motion: {folder / 'previews' / 'motion.html'}" in output
    assert "| generated |" in output
    assert "mlflow ui --backend-store-uri sqlite:///mlflow.db" in output
    assert f"/runs/{(folder / RUN_ID_FILE).read_text()}?workflowType=machine_learning" in output
    assert {"generator.pt", "summary.json", "metrics.md", "config.yaml"} <= {path.name for path in folder.iterdir()}
    assert (place / "mlflow.db").exists()


def test_summary_holds_what_a_reader_needs(trained):
    summary = json.loads((trained[0] / "summary.json").read_text())
    assert summary["seed"] == 0
    assert summary["wall_time_seconds"] > 0
    assert summary["peak_memory_mib"] > 100
    assert len(summary["data"]["fingerprint"]) == 64
    evaluation = summary["evaluation"]
    assert set(evaluation["systems"]) == {"real", "generated", "untrained"}
    fid = evaluation["systems"]["generated"]["metrics"]["fid"]
    assert len(fid["values"]) == 2
    assert fid["mean"] == pytest.approx(sum(fid["values"]) / 2)
    assert evaluation["count"] > 0


def test_the_tracker_holds_the_run(trained, place):
    client = mlflow.MlflowClient(f"sqlite:///{place / 'mlflow.db'}")
    experiment = client.get_experiment_by_name("motiongen")
    (run,) = client.search_runs([experiment.experiment_id])
    assert run.info.status == "FINISHED"
    assert run.data.params["generator.decoder.layers"] == "3"
    summary = json.loads((trained[0] / "summary.json").read_text())
    expected = summary["evaluation"]["systems"]["generated"]["metrics"]["accuracy"]["mean"]
    assert run.data.metrics["generated/accuracy"] == pytest.approx(expected)
    assert len(client.get_metric_history(run.info.run_id, "train/loss")) == EPOCHS
    previews = {Path(file.path).name for file in client.list_artifacts(run.info.run_id, "previews")}
    assert {"motion.html", "motion.gif"} <= previews


def test_killed_and_resumed_it_ends_with_the_same_weights_and_figures(trained, place):
    whole, killed = trained[0], place / "killed"
    process = start(place, *TRAIN, "tracker=none", f"hydra.run.dir={killed}")
    deadline = time.monotonic() + 300
    while not (killed / "checkpoints" / "last.ckpt").exists():
        assert process.poll() is None, process.communicate()[0]
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert not (killed / "generator.pt").exists()
    finish(start(place, f"resume={killed}"))
    expected = torch.load(whole / "generator.pt", weights_only=True)["state"]
    resumed = torch.load(killed / "generator.pt", weights_only=True)["state"]
    for name, value in expected.items():
        assert torch.equal(value, resumed[name]), name
    assert figures(whole) == figures(killed)


def test_evaluating_again_gives_the_same_figures(trained, place):
    finish(start(place, "task=evaluate", f"run={trained[0]}", "tracker=none", f"hydra.run.dir={place / 'again'}"))
    assert figures(trained[0]) == figures(place / "again")


def test_a_timeline_becomes_a_motion(trained, place):
    folder = place / "long"
    finish(
        start(
            place,
            "task=synthesize",
            f"run={trained[0]}",
            "timeline='walk 1 s, sit down 0.5 s, wave hand 1 s'",
            "formats=[amass,bvh,csv,glb]",
            "tracker=none",
            f"hydra.run.dir={folder}",
        )
    )
    motion = np.load(folder / "motion.npz", allow_pickle=False)
    assert motion["boundaries"].tolist() == [6, 36, 51, 81]
    assert motion["features"].shape == (81, 135)
    joints = joint_positions(torch.from_numpy(motion["features"]), Skeleton(torch.from_numpy(motion["offsets"])))
    assert torch.isfinite(joints).all()
    assert (folder / "motion.html").stat().st_size > 10_000
    table = np.loadtxt(folder / "motion.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 2:], joints.flatten(1).numpy(), atol=1e-5)
    assert {"motion.amass.npz", "motion.bvh", "motion.glb"} <= {path.name for path in folder.iterdir()}


def test_an_unknown_tag_is_named(trained, place):
    process = start(place, "task=synthesize", f"run={trained[0]}", "timeline=wlak 2 s", "tracker=none")
    output, _ = process.communicate(timeout=300)
    assert process.returncode == 1
    assert "unknown tag 'wlak'; did you mean 'walk'" in output
    assert "Traceback" not in output
