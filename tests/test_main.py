from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from motiongen.application import with_quotes
from motiongen.configuration import compose

LIMIT = 2.0
"""Seconds within which the command line answers, of processor time: it waits for nothing, and wall time would also tell
what else the machine does."""


def motiongen(folder: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "motiongen", *arguments],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize(
    "value",
    [
        "walk 3, turn 1.5, walk 2, wave_hand 2",
        "stand + head movement 2 s, walk",
        "it's 3, b (x) = 2",
        r"C:\motions\a.yaml",
        "x\\'y\\",
        "mine.yaml",
    ],
)
def test_a_timeline_is_read_as_the_shell_hands_it_on(value: str) -> None:
    assert compose(["+experiment=marionette", with_quotes(f"timeline={value}")]).timeline == value


@pytest.mark.parametrize("argument", ["timeline='a, b'", 'timeline="a, b"', "timeline=null", "timeline=", "seed=1,2"])
def test_what_hydra_understands_is_left_alone(argument: str) -> None:
    assert with_quotes(argument) == argument


ANSWERS = [
    (["--help"], 0, "+experiment=marionette"),
    (["task=list"], 0, "reverse_positional_encoding"),
    ([], 1, "needs an experiment"),
    (["+experiment=marionette", "generator/encoder=nonsense"], 1, "there is no such option"),
    (["+experiment=marionette", "generator.encoder.layrs=2"], 1, "did you mean 'generator.encoder.layers'?"),
    (["+experiment=marionette", "generator.encoder.dropout=7"], 1, "a number from 0 to 1"),
    (["+experiment=marionette", "data=bandai", "data.source.root=/nowhere"], 1, "/nowhere does not exist"),
    (["-m", "+experiment=marionette", "seed=0,1", "generator/encoder=condition_encoder,nonsense"], 1, "nonsense"),
    (["task=evaluate", "run=."], 1, "is not the folder of a run"),
    (["task=synthesize", "run=.", "timeline=walk 3, turn 1.5"], 1, "is not the folder of a run"),
    (["+experiment=marionette", "task=synthesize", "formats=[bvh,gbl]"], 1, "did you mean 'glb'?"),
    (["resume=."], 1, "is not the folder of a run"),
    (["+experiment=marionette", "+search=hybrid"], 1, "a search is a multirun: add -m"),
    (["-m", "+ablation/systems=glob(*)", "seed=0,1", "data.batch_sise=3"], 1, "did you mean 'data.batch_size'?"),
    (["task=report", "study=nonsense"], 1, "study=nonsense: there is no such option"),
]


@pytest.mark.parametrize(("arguments", "code", "told"), ANSWERS)
def test_answers_at_once_and_leaves_nothing_behind(tmp_path: Path, arguments: list[str], code: int, told: str) -> None:
    seconds = []
    for _ in range(3):
        before = os.times()
        answer = motiongen(tmp_path, *arguments)
        after = os.times()
        seconds.append(after.children_user + after.children_system - before.children_user - before.children_system)
        if seconds[-1] < LIMIT:
            break
    assert answer.returncode == code, answer.stderr
    assert told in (answer.stderr if code else answer.stdout)
    assert "Traceback" not in answer.stderr
    assert list(tmp_path.iterdir()) == []
    assert min(seconds) < LIMIT


def test_flags_may_stand_anywhere(tmp_path: Path) -> None:
    answer = motiongen(tmp_path, "+experiment=marionette", "-m", "generator.encoder.dropout=0.1,7")
    assert "generator.encoder.dropout=7" in answer.stderr


@pytest.mark.parametrize("argument", ["--help", "task=list"])
def test_a_reader_that_has_seen_enough_is_no_error(tmp_path: Path, argument: str) -> None:
    command = [sys.executable, "-m", "motiongen", argument]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout
        assert process.stderr
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 0


def test_nothing_heavy_is_imported_for_an_answer(tmp_path: Path) -> None:
    answer = motiongen(tmp_path, "+experiment=marionette", "generator.encoder.dropout=7", PYTHONPROFILEIMPORTTIME="1")
    modules = {
        line.rpartition("|")[2].strip() for line in answer.stderr.splitlines() if line.startswith("import time:")
    }
    assert "motiongen.configuration" in modules
    assert not modules & {"torch", "pytorch_lightning", "mlflow", "numpy", "optuna"}


def test_cfg_prints_the_configuration_without_running_it(tmp_path: Path) -> None:
    answer = motiongen(tmp_path, "+experiment=marionette", "seed=5", "--cfg", "job")
    assert answer.returncode == 0
    assert "seed: 5" in answer.stdout
    assert "ConditionEncoder" in answer.stdout


TINY = ["task=prepare", "data.source.sessions=4", "data.min_clips=2"]


def test_every_run_has_a_folder_named_by_what_ran(tmp_path: Path) -> None:
    answer = motiongen(tmp_path, "-m", *TINY, "seed=0,1", MOTIONGEN_CACHE=str(tmp_path / "cache"))
    assert answer.returncode == 0, answer.stderr
    (sweep,) = (tmp_path / "runs" / "multirun").iterdir()
    names = sorted(path.name.partition("-data.")[0] for path in sweep.iterdir() if path.is_dir())
    assert names == ["0-prepare-builtin-small-s0", "1-prepare-builtin-small-s1"]
    assert (tmp_path / "cache").is_dir()


def test_wrong_data_is_told_without_a_trace(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    answer = motiongen(
        tmp_path, "task=prepare", "data=bandai", "data.source.root=data", MOTIONGEN_CACHE=str(tmp_path / "cache")
    )
    assert answer.returncode == 1
    assert answer.stderr.splitlines()[-1].startswith("motiongen: ")
    assert "Traceback" not in answer.stderr
