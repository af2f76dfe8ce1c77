from __future__ import annotations

import json
from pathlib import Path

import pytest
from omegaconf import OmegaConf, open_dict

from motiongen.configuration import compose
from motiongen.studies.callback import StudyCallback

COMMAND = ["+ablation/actor_architecture=gru", "tracker=none", "scale=smoke"]


def row(study: Path, name: str, left: str, *overrides: str) -> None:
    folder = study / name
    (folder / ".hydra").mkdir(parents=True)
    OmegaConf.save(OmegaConf.create([*COMMAND, *overrides]), folder / ".hydra" / "overrides.yaml")
    (folder / "row.lock").touch()
    (folder / left).write_text(json.dumps({"reason": "it broke"}))


def summed_up(study: Path, *overrides: str) -> None:
    config = compose([*COMMAND, *overrides], with_hydra=True)
    with open_dict(config):
        config.hydra.sweep.dir = str(study)
    StudyCallback().on_multirun_end(config)


def test_a_study_sums_up_the_rows_of_its_own_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    row(tmp_path, "done-s0", "summary.json", "seed=0")
    row(tmp_path, "done-s1", "summary.json", "seed=1")
    row(tmp_path, "broken-s0", "failed.json", "seed=0", "data.draws=4")
    summed_up(tmp_path, "seed=1")
    told = capsys.readouterr().out
    assert "actor_architecture: 2 rows and seeds done" in told
    assert "broken" not in told, "it belongs to another command"
    with pytest.raises(SystemExit, match="1 rows failed"):
        summed_up(tmp_path, "data.draws=4")
    told = capsys.readouterr().out
    assert "- broken-s0: it broke" in told
    assert "task=report study=actor_architecture data=builtin scale=smoke data.draws=4\n" in told
