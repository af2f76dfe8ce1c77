from __future__ import annotations

from pathlib import Path

import pytest
from omegaconf import OmegaConf

from motiongen.runs import RunError, completed


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """The folder of a run that was started in `tmp_path`."""
    folder = tmp_path / "runs" / "it's one"
    (folder / ".hydra").mkdir(parents=True)
    OmegaConf.save(OmegaConf.create(["+experiment=x", "seed=1", "scale=smoke"]), folder / ".hydra" / "overrides.yaml")
    OmegaConf.save({"hydra": {"runtime": {"cwd": str(tmp_path)}}}, folder / ".hydra" / "hydra.yaml")
    return folder


def test_other_command_lines_stay_as_they_are() -> None:
    assert completed(["+experiment=x", "seed=1", "resume=null"]) == ["+experiment=x", "seed=1", "resume=null"]


def test_a_run_goes_on_with_its_own_overrides_where_it_was_started(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (run / "checkpoints").mkdir()
    (run / "checkpoints" / "last.ckpt").touch()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    arguments = completed([f"resume={run}"])
    assert arguments[:3] == ["+experiment=x", "seed=1", "scale=smoke"]
    quoted = str(run).replace("'", "\\'")
    assert arguments[3:] == [f"resume='{quoted}'", f"hydra.run.dir='{quoted}'"]
    assert Path.cwd() == tmp_path


def test_a_run_without_a_checkpoint_cannot_go_on(run: Path) -> None:
    with pytest.raises(RunError, match=r"has no last\.ckpt"):
        completed([f"resume={run}"])


def test_training_from_a_run_takes_nothing_else_of_it(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (run / "generator.pt").touch()
    monkeypatch.chdir(run.parent)
    arguments = completed(["+experiment=y", "init=it's one", "seed=2"])
    quoted = str(run).replace("'", "\\'")
    assert arguments == ["+experiment=y", "seed=2", f"init='{quoted}'"]
    assert completed(["+experiment=y", "init=null"]) == ["+experiment=y", "init=null"]


def test_a_run_by_its_generator_or_by_its_id_in_mlflow(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (run / "generator.pt").touch()
    (run / "mlflow_run_id").write_text("0123456789abcdef" * 2)
    monkeypatch.chdir(tmp_path)
    whole = completed(["task=evaluate", f"run={run}"])
    assert completed(["task=evaluate", f"run={run / 'generator.pt'}"]) == whole
    assert completed(["task=evaluate", f"run={'0123456789abcdef' * 2}"]) == whole
    with pytest.raises(RunError, match=r"no folder below .* is that of the MLflow run ffff"):
        completed(["task=evaluate", f"run={'f' * 32}"])


def test_runs_whose_names_hold_signs_of_the_command_line(run: Path, tmp_path: Path) -> None:
    (run / "generator.pt").touch()
    other = tmp_path / "runs" / "small-data.draws=7"
    run.rename(other)
    assert completed(["task=compare", f"runs=[{other}, '{other}']", "data=x"]) == [
        "task=compare",
        f"runs=['{other}','{other}']",
        "data=x",
    ]
    (other / "generator.pt").unlink()
    with pytest.raises(RunError, match=r"runs: .*draws=7 has no generator\.pt"):
        completed(["task=compare", f"runs=[{other}]"])


def test_training_from_a_run_needs_its_generator(run: Path) -> None:
    with pytest.raises(RunError, match=r"init: .* has no generator\.pt: its training did not finish"):
        completed(["+experiment=y", f"init={run}"])


def test_a_folder_that_is_not_a_run_is_refused(tmp_path: Path) -> None:
    for key in ("resume", "run", "init"):
        with pytest.raises(RunError, match=rf"{key}: .* is not the folder of a run"):
            completed([f"{key}={tmp_path}"])


def test_a_run_goes_on_unchanged(run: Path) -> None:
    (run / "last.ckpt").touch()
    with pytest.raises(RunError, match="leave out seed=2"):
        completed([f"resume={run}", "seed=2"])


def test_what_is_typed_comes_on_top_of_the_run_that_is_used(run: Path) -> None:
    (run / "generator.pt").touch()
    arguments = completed(["task=evaluate", f"run={run}", "scale=small", "evaluation.seeds=3"])
    assert arguments[:-1] == ["+experiment=x", "seed=1", "task=evaluate", "scale=small", "evaluation.seeds=3"]
    assert arguments[-1].startswith("run=")


def test_a_run_without_a_generator_cannot_be_used(run: Path) -> None:
    with pytest.raises(RunError, match=r"no generator\.pt"):
        completed(["task=evaluate", f"run={run}"])
