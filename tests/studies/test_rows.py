from __future__ import annotations

import logging
from pathlib import Path

import pytest
from filelock import FileLock
from omegaconf import DictConfig

from motiongen.configuration import compose
from motiongen.errors import InputError
from motiongen.studies.rows import EARLIER, LOCK_FILE, failure, run_row, state_of


class Task:
    """Counts its runs; does what it is told to in the folder."""

    def __init__(self, studies: Path, study: str = "study") -> None:
        self.folder = studies / study / "builtin-smoke" / "row"
        self.folder.mkdir(parents=True)
        self.resumed: list[str | None] = []
        self.breaks: Exception | type[KeyboardInterrupt] | None = None
        self.finishes = True

    def __call__(self, config: DictConfig) -> None:
        self.resumed.append(config.resume)
        (self.folder / "checkpoints").mkdir(exist_ok=True)
        (self.folder / "checkpoints" / "last.ckpt").touch()
        if self.breaks is not None:
            raise self.breaks
        if self.finishes:
            (self.folder / "summary.json").write_text("{}")


@pytest.fixture
def task(tmp_path: Path) -> Task:
    return Task(tmp_path)


def run(task: Task, *changes: str) -> None:
    run_row(task, compose(["+experiment=actor", "scale=smoke", *changes]), task.folder)


def test_a_row_that_is_done_is_not_run_again(task: Task, caplog: pytest.LogCaptureFixture) -> None:
    run(task)
    with caplog.at_level(logging.INFO):
        run(task)
    assert task.resumed == [None]
    assert "reused" in caplog.text


def test_an_interrupted_row_goes_on_from_its_checkpoint(task: Task) -> None:
    task.breaks = KeyboardInterrupt
    with pytest.raises(KeyboardInterrupt):
        run(task)
    assert state_of(task.folder) == "unfinished"
    task.breaks = None
    run(task)
    assert task.resumed == [None, str(task.folder)]
    assert state_of(task.folder) == "done"


@pytest.mark.parametrize("error", [InputError("data: no clips"), RuntimeError("no memory")])
def test_a_failed_row_stops_nothing_and_is_retried_on_demand(task: Task, error: Exception) -> None:
    task.breaks = error
    run(task)
    assert state_of(task.folder) == "failed"
    assert str(error) in failure(task.folder)
    task.breaks = None
    run(task)
    assert len(task.resumed) == 1
    run(task, "retry_failed=true")
    assert len(task.resumed) == 2
    assert state_of(task.folder) == "done"


def test_another_configuration_runs_anew_and_nothing_is_lost(task: Task) -> None:
    run(task)
    run(task, "evaluation.seeds=7")
    assert task.resumed == [None, None]
    assert (task.folder / EARLIER / "1" / "summary.json").is_file()
    assert state_of(task.folder) == "done"


def test_other_code_runs_anew_unless_any_code_will_do(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    run(task)
    monkeypatch.setattr("motiongen.studies.identity.code_digest", lambda further: "other")
    run(task, "reuse=any_code")
    assert len(task.resumed) == 1
    run(task)
    assert len(task.resumed) == 2


def test_a_row_that_another_process_is_at_is_left_to_it(task: Task, caplog: pytest.LogCaptureFixture) -> None:
    with FileLock(task.folder / LOCK_FILE), caplog.at_level(logging.INFO):
        run(task)
    assert task.resumed == []
    assert "another process" in caplog.text


@pytest.mark.parametrize(("change", "resumes"), [((), True), (("seed=1",), False)])
def test_what_another_study_trained_is_not_trained_again(
    tmp_path: Path, change: tuple[str, ...], resumes: bool
) -> None:
    first, second = Task(tmp_path, "one"), Task(tmp_path, "two")
    run(first)
    run(second, *change)
    assert second.resumed == [str(second.folder) if resumes else None]
    assert state_of(second.folder) == "done"
