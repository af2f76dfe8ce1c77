"""Fine-tuning from the weights of another run, on the command line at `scale=smoke`."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import torch

COMMON = ["scale=smoke", "data.source.sessions=16", "evaluation.seeds=2", "tracker=none"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runs")


def motiongen(place: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"MOTIONGEN_CACHE": str(place / "cache"), "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        [sys.executable, "-m", "motiongen", *arguments, *COMMON],
        cwd=place,
        env=environment,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )


@pytest.fixture(scope="module")
def fixed(place: Path) -> Path:
    """A run of ACTOR at 60 frames."""
    answer = motiongen(place, "+experiment=actor", "trainer.max_epochs=2", "hydra.run.dir=fixed")
    assert answer.returncode == 0, answer.stderr
    return place / "fixed"


def weights(folder: Path) -> dict[str, torch.Tensor]:
    return torch.load(folder / "generator.pt", weights_only=True)["state"]


def test_training_starts_from_the_weights_of_the_other_run(place: Path, fixed: Path) -> None:
    """A learning rate of 0 keeps what training starts from."""
    still = ["optimizer.optimizer.lr=0", "trainer.max_epochs=1", "init=fixed", "hydra.run.dir=tuned"]
    answer = motiongen(place, "+experiment=actor_variable_length", *still)
    assert answer.returncode == 0, answer.stderr
    before, after = weights(fixed), weights(place / "tuned")
    assert before.keys() == after.keys()
    for name, value in before.items():
        assert torch.equal(value, after[name]), name
    assert f"init: {fixed}" in (place / "tuned" / "config.yaml").read_text()


def test_weights_that_do_not_fit_are_refused(place: Path, fixed: Path) -> None:
    other = ["+experiment=actor", "generator/encoder=mean_pooling", f"init={fixed}", "hydra.run.dir=other"]
    answer = motiongen(place, *other)
    assert answer.returncode == 1
    assert "generator.pt: field 'state' does not fit this composition" in answer.stderr
    assert "Traceback" not in answer.stderr
    assert not (place / "other" / "generator.pt").exists()
