"""Training that starts from the weights of another run, at `scale=smoke`."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import torch
from omegaconf import OmegaConf

from motiongen.configuration import compose
from motiongen.generation.checkpoint import CheckpointError, save_generator
from motiongen.tasks.assembly import build_data, build_generator, first_generator

COMMON = ["scale=smoke", "data.source.sessions=8", "data.min_clips=2", "evaluation.seeds=2", "tracker=none"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="module")
def other(place: Path) -> Path:
    """The folder of a run of ACTOR at 60 frames; the weights are those of seed 5."""
    overrides = ["+experiment=actor", *COMMON, "seed=5", f"cache={place / 'cache'}"]
    config = compose(overrides)
    folder = place / "other"
    (folder / ".hydra").mkdir(parents=True)
    OmegaConf.save(OmegaConf.create(overrides), folder / ".hydra" / "overrides.yaml")
    data = build_data(compose([*overrides, "seed=0"]))
    save_generator(folder / "generator.pt", build_generator(config, data), data.tags, ())
    return folder


def weights(folder: Path) -> dict[str, torch.Tensor]:
    return torch.load(folder / "generator.pt", weights_only=True)["state"]


def test_training_starts_from_the_weights_of_the_other_run(place: Path, other: Path) -> None:
    """A learning rate of 0 keeps what training starts from, so that it can be read afterwards."""
    still = ["optimizer.optimizer.lr=0", "trainer.max_epochs=1", "init=other", "hydra.run.dir=tuned"]
    answer = subprocess.run(
        [sys.executable, "-m", "motiongen", "+experiment=actor_variable_length", *still, *COMMON],
        cwd=place,
        env=os.environ | {"MOTIONGEN_CACHE": str(place / "cache"), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=1200,
        check=False,
    )
    assert answer.returncode == 0, answer.stderr
    before, after = weights(other), weights(place / "tuned")
    assert before.keys() == after.keys()
    for name, value in before.items():
        assert torch.equal(value, after[name]), name
    assert OmegaConf.load(place / "tuned" / "config.yaml").init == str(other)


def test_weights_that_do_not_fit_are_refused(place: Path, other: Path) -> None:
    start = ["+experiment=actor", *COMMON, f"cache={place / 'cache'}", f"init={other}"]
    data = build_data(compose(start))
    for change, field in (("generator/encoder=mean_pooling", "state"), ("generator.width=24", "dimensions")):
        with pytest.raises(CheckpointError, match=rf"generator\.pt: field '{field}'"):
            first_generator(compose([*start, change]), data)
