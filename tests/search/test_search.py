from __future__ import annotations

import json
import sqlite3
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import optuna
import pytest
from optuna.trial import TrialState

from motiongen.errors import InputError
from motiongen.search import storage
from motiongen.search.naming import trial_folder
from motiongen.search.objectives import ObjectiveError, measured
from motiongen.search.report import write_report
from motiongen.search.search import OVERRIDES, REASON, REFUSED, Asked, Budget, Search, spent
from motiongen.search.space import Space
from motiongen.search.storage import StorageError
from motiongen.search.workers import Worker

OBJECTIVES = {"fid": "minimize", "accuracy": "maximize"}


@pytest.fixture
def worker(tmp_path: Path) -> Iterator[Worker]:
    with Worker(tmp_path / "workers") as own:
        yield own


def search(
    folder: Path, worker: Worker, *, trials: int = 4, place: str = "", objectives: dict[str, str] = OBJECTIVES
) -> Search:
    return Search(
        name="test",
        place=place or str(folder / "journal.log"),
        folder=folder,
        objectives=objectives,
        space=Space({"x": "interval(0.0, 1.0)", "kind": "choice(a, b)"}, {}),
        sampler=optuna.samplers.RandomSampler(seed=0),
        budget=Budget(trials, None),
        worker=worker,
    )


def never(overrides: object) -> None:
    """No composition is refused."""


def finish(own: Search, asked: Asked, fid: float | None = 1.0, accuracy: float = 0.5) -> None:
    """What a job leaves behind."""
    folder = own.folder / trial_folder(asked.number)
    folder.mkdir()
    metrics = {"fid": {"mean": fid}, "accuracy": {"mean": accuracy}}
    (folder / "summary.json").write_text(json.dumps({"evaluation": {"systems": {"generated": {"metrics": metrics}}}}))


def asked(own: Search) -> Asked:
    one = own.ask(never)
    assert one is not None
    return one


def test_trials_are_asked_and_told_until_the_budget_is_spent(tmp_path: Path, worker: Worker) -> None:
    own = search(tmp_path, worker, trials=3)
    for number in range(3):
        one = asked(own)
        assert one.number == number
        assert [text.partition("=")[0] for text in one.overrides] == ["x", "kind"]
        finish(own, one, fid=float(number))
        own.tell(one.number, None)
    assert own.ask(never) is None
    assert [trial.values for trial in own.trials()] == [[0.0, 0.5], [1.0, 0.5], [2.0, 0.5]]


def test_failed_pruned_and_unmeasured_trials_are_kept_with_their_reason(tmp_path: Path, worker: Worker) -> None:
    own = search(tmp_path, worker)
    broken, pruned, nothing, odd = (asked(own) for _ in range(4))
    own.tell(broken.number, RuntimeError("no memory"))
    own.tell(pruned.number, optuna.TrialPruned())
    own.tell(nothing.number, None)
    finish(own, odd, fid=None)
    own.tell(odd.number, None)
    trials = own.trials()
    states = [trial.state for trial in trials]
    assert states == [TrialState.FAIL, TrialState.PRUNED, TrialState.FAIL, TrialState.FAIL]
    assert trials[0].user_attrs[REASON] == "RuntimeError: no memory"
    assert "no summary" in trials[2].user_attrs[REASON]
    assert "fid is not a number" in trials[3].user_attrs[REASON]
    assert spent(trials) == 4


def test_refused_compositions_cost_nothing(tmp_path: Path, worker: Worker) -> None:
    own = search(tmp_path, worker, trials=1)
    reasons = iter(["the decoder reads no past", "no stage reads the action", None])
    one = own.ask(lambda overrides: next(reasons))
    assert one is not None
    assert one.number == 2
    assert [REFUSED in trial.user_attrs for trial in own.trials()] == [True, True, False]
    assert spent(own.trials()) == 1
    with pytest.raises(InputError, match="were refused one after another; the last: never"):
        search(tmp_path, worker, trials=9).ask(lambda overrides: "never")


def test_two_workers_share_the_trials(tmp_path: Path, worker: Worker) -> None:
    with Worker(tmp_path / "workers") as second:
        one, other = search(tmp_path, worker, trials=2), search(tmp_path, second, trials=2)
        assert [asked(one).number, asked(other).number] == [0, 1]
        one.take_over()
        assert [trial.state for trial in one.trials()] == [TrialState.RUNNING] * 2
        assert one.ask(never) is None
        assert other.ask(never) is None


def test_what_a_killed_worker_left_is_counted_or_tried_again(tmp_path: Path, worker: Worker) -> None:
    """A process asks for two trials, finishes one of them, and is killed before it tells."""
    script = f"""
        import os, signal
        from pathlib import Path
        from tests.search.test_search import asked, finish, search
        from motiongen.search.workers import Worker
        folder = Path({str(tmp_path)!r})
        with Worker(folder / "workers") as own:
            mine = search(folder, own)
            finish(mine, asked(mine), fid=7.0)
            asked(mine)
            os.kill(os.getpid(), signal.SIGKILL)
    """
    root = Path(__file__).parents[2]
    died = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], cwd=root, check=False)
    assert died.returncode != 0
    own = search(tmp_path, worker)
    assert [trial.state for trial in own.trials()] == [TrialState.RUNNING] * 2
    own.take_over()
    measured, undone, again = own.trials()
    assert measured.values == [7.0, 0.5]
    assert (undone.state, again.state) == (TrialState.FAIL, TrialState.WAITING)
    assert spent(own.trials()) == 1
    one = asked(own)
    assert one.number == again.number
    assert one.overrides == undone.user_attrs[OVERRIDES]


def test_a_locked_database_is_waited_for_and_then_named_and_nothing_is_lost(
    tmp_path: Path, worker: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(storage, "SECONDS_TO_WAIT", 0.1)
    monkeypatch.setattr(storage.time, "sleep", lambda seconds: None)
    database = tmp_path / "search.db"
    own = search(tmp_path, worker, place=f"sqlite:///{database}")
    one = asked(own)
    finish(own, one)
    other = sqlite3.connect(database, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(StorageError, match=r"search\.db.*locked.*goes on from there"):
        own.tell(one.number, None)
    other.execute("ROLLBACK")
    other.close()
    own.tell(one.number, None)
    assert own.trials()[0].values == [1.0, 0.5]


def test_an_objective_that_the_task_does_not_measure_is_named(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text(json.dumps({"recognizer": {"test_accuracy": 0.9}}))
    assert measured(tmp_path, ["recognizer_accuracy"]) == [0.9]
    with pytest.raises(ObjectiveError, match=r"summary\.json: fid was not measured by this task"):
        measured(tmp_path, ["fid"])


def test_wrong_settings_are_named(tmp_path: Path, worker: Worker) -> None:
    with pytest.raises(ObjectiveError, match="no metric 'fido'; did you mean 'fid'"):
        search(tmp_path, worker, objectives={"fido": "minimize"})
    with pytest.raises(ObjectiveError, match=r"objectives\.fid=down: takes minimize or maximize"):
        search(tmp_path, worker, objectives={"fid": "down"})
    search(tmp_path, worker)
    with pytest.raises(InputError, match="take another name"):
        search(tmp_path, worker, objectives={"fid": "minimize"})
    with pytest.raises(StorageError, match="cannot be opened"):
        search(tmp_path, worker, place="nonsense://nowhere")


def test_the_report_names_the_pareto_set_and_the_command_for_it(
    tmp_path: Path, worker: Worker, capsys: pytest.CaptureFixture[str]
) -> None:
    own = search(tmp_path, worker, trials=5)
    for fid, accuracy in ((1.0, 0.2), (2.0, 0.8), (3.0, 0.5), (4.0, 0.9)):
        one = asked(own)
        finish(own, one, fid, accuracy)
        own.tell(one.number, None)
    own.tell(asked(own).number, RuntimeError("no memory"))
    paths = write_report(own, ["+experiment=actor", "+search=hybrid", "scale=smoke", "hydra.sweeper.trials=5"])
    assert {path.name for path in paths} == {"trials.csv", "report.md", "pareto.png", "importance.png"}
    assert all(path.stat().st_size for path in paths)
    text = capsys.readouterr().out
    rows = [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| ")]
    assert rows[2:] == ["0", "1", "3"]
    assert "trial 4 failed: RuntimeError: no memory" in text
    command = next(line for line in text.splitlines() if "python -m motiongen" in line)
    assert "-m +experiment=actor scale=smoke x=" in command
    assert command.endswith("seed=0,1,2")
