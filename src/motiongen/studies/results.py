"""What the rows of a study measured, read back from MLflow."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from omegaconf import DictConfig

from motiongen.errors import InputError
from motiongen.evaluation.results import REAL
from motiongen.evaluation.stored import StoredResult, alike, read_result, read_summary
from motiongen.evaluation.stored_long import long_result
from motiongen.runs import SUMMARY_FILE, run_id_in
from motiongen.schemas import problem_in
from motiongen.studies.naming import CHANGES, StudyError
from motiongen.tracking.mlflow import PARENT

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Run

GENERATED = "generated"
ROW = {
    "required": ["seeds"],
    "properties": {
        "recognizer": {"required": ["test_accuracy"]},
        "systems": {"required": [GENERATED, REAL]},
    },
}
"""JSON schema of what a table of a study reads of an evaluation, besides what all tables do"""


@dataclass(frozen=True)
class StudyResults:
    """The results of a study's rows, all measured alike."""

    study: str
    run_id: str
    """Of the study in MLflow"""
    rows: Mapping[str, tuple[StoredResult, ...]]
    """Row to the results of its trainings, in the order of their seeds"""
    unfinished: tuple[str, ...]
    """Names of rows and seeds that have no result, with what became of them"""
    runs: Mapping[str, str] = field(default_factory=dict)
    """Row to the id of its first training's run in MLflow"""
    changes: str = ""
    """What the command line changed about all rows"""

    def values(self, row: str, metric: str, system: str = GENERATED) -> tuple[float, ...]:
        """A metric of every training of a row that measured it: the mean over its generation seeds."""
        measured = (one.evaluation["systems"][system]["metrics"].get(metric, {}) for one in self.rows[row])
        return tuple(float(figures["mean"]) for figures in measured if figures.get("mean") is not None)

    def real(self, metric: str) -> float | None:
        """The metric of the real test clips."""
        first = next(iter(self.rows))
        return next(iter(self.values(first, metric, REAL)), None)

    def second_opinion(self) -> StudyResults | None:
        """The same motions before the second recognizer; None where not all trainings have the same one."""
        rows = {
            row: tuple(replace(one, evaluation=one.second_evaluation) for one in own if one.second_evaluation)
            for row, own in self.rows.items()
        }
        complete = all(len(rows[row]) == len(own) for row, own in self.rows.items())
        return replace(self, rows=rows) if complete and len(alike(chain(*rows.values()))) == 1 else None


def study_results(tracker: DictConfig, study: str, folder: Path, changes: str = "") -> StudyResults:
    """Everything that was measured in the study whose folder this is, with these overrides to all rows.

    Args:
        tracker: the configuration of the tracker that the study was run with.
        study: its name.
        folder: where its rows lie.
        changes: the overrides, as `changes_text` writes them. None stand for those of all rows, if they have the same.

    Raises:
        StudyError: nothing was measured, or with other overrides, no MLflow tracker, or results that do not compare.
    """
    if tracker.get("uri") is None:
        raise StudyError("report: a study's results are read from MLflow; tracker=none has none")
    os.environ.setdefault("MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR", "false")
    from mlflow import MlflowClient

    parent = run_id_in(folder)
    if not parent:
        raise StudyError(f"report: {folder.absolute()} has no study; run it first: -m '+ablation/{study}=glob(*)'")
    client = MlflowClient(tracker.uri)
    finished: dict[str, dict[int, StoredResult]] = {}
    ids: dict[str, dict[int, str]] = {}
    unfinished: dict[str, str] = {}
    children = list(_children(client, tracker.experiment, parent))
    changes = _changes_meant(changes, {_changes_of(run) for run in children}, study)
    for run in children:
        if _changes_of(run) != changes:
            continue
        name = str(run.info.run_name)
        unfinished.pop(name, None)
        if run.info.status == "FINISHED":
            row, seed = run.data.tags["row"], int(run.data.tags["seed"])
            finished.setdefault(row, {})[seed] = _result(client, run)
            ids.setdefault(row, {})[seed] = str(run.info.run_id)
        else:
            unfinished[name] = str(run.info.status).lower()
    if not finished:
        raise StudyError(f"report: no row of {study} has finished in {tracker.uri}")
    rows = {row: tuple(results[seed] for seed in sorted(results)) for row, results in sorted(finished.items())}
    _require_alike(rows)
    told = tuple(f"{name}: {status}" for name, status in unfinished.items())
    firsts = {row: ids[row][min(ids[row])] for row in rows}
    return StudyResults(study, parent, rows, told, firsts, changes)


def _children(client: MlflowClient, experiment: str, parent: str) -> Iterator[Run]:
    """The runs of the rows, the oldest first."""
    found = client.get_experiment_by_name(experiment)
    token = None
    while found is not None:
        page = client.search_runs(
            [found.experiment_id], f"tags.`{PARENT}` = '{parent}'", order_by=["start_time"], page_token=token
        )
        yield from page
        token = page.token
        if not token:
            return


def _changes_of(run: Run) -> str:
    return str(run.data.tags.get(CHANGES, ""))


def _changes_meant(asked: str, there: Set[str], study: str) -> str:
    """Which of the overrides that rows were run with are asked for."""
    if asked in there or not there:
        return asked
    if not asked and len(there) == 1:
        return next(iter(there))
    lines = "\n".join(f"- {changes or '(none)'}" for changes in sorted(there))
    raise StudyError(
        f"report: no row of {study} was run with {asked or 'no further overrides'}; name those of one table, as in "
        f"task=report study={study} <overrides>. Rows were run with\n{lines}"
    )


def _result(client: MlflowClient, run: Run) -> StoredResult:
    with tempfile.TemporaryDirectory() as folder:
        client.download_artifacts(run.info.run_id, SUMMARY_FILE, folder)
        return row_result(Path(folder))


def row_result(folder: Path) -> StoredResult:
    """What a row measured, from the summary in this folder: of single actions or of long motion.

    Raises:
        InputError: there is no summary, or it is damaged; the message names the file and the field.
    """
    summary = read_summary(folder)
    if "sequences" in summary:
        return long_result(summary)
    result = read_result(folder)
    for name, evaluation in (("evaluation", result.evaluation), ("second_evaluation", result.second_evaluation)):
        if evaluation and (problem := problem_in(evaluation, ROW)):
            raise InputError(f"results: {folder / SUMMARY_FILE}: {name}: {problem}; it is not that of a row")
    return result


def _require_alike(rows: Mapping[str, tuple[StoredResult, ...]]) -> None:
    groups = alike(result for results in rows.values() for result in results)
    if len(groups) > 1:
        differing = "\n".join(f"- {text}" for text in groups[0][0].differences(groups[1][0]))
        raise StudyError(
            f"report: {groups[0][0].name} and {groups[1][0].name} were not measured alike:\n{differing}\n"
            "run the study again: rows whose configuration, data or code changed are run anew"
        )
