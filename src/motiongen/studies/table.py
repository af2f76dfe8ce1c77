"""A study's table: every row's figures over its trainings, beside the published ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, Literal

from omegaconf import DictConfig

from motiongen.evaluation.stored_long import LONG_HEADINGS
from motiongen.evaluation.table import FURTHER, HEADINGS
from motiongen.evaluation.uncertainty import Interval
from motiongen.studies.naming import StudyError
from motiongen.studies.results import StudyResults
from motiongen.studies.statistics import best_and_ties, mean_costs, over_trainings, rank_agreement
from motiongen.suggestions import did_you_mean

KNOWN = HEADINGS | FURTHER | LONG_HEADINGS
Mark = Literal["best", "tie", ""]


@dataclass(frozen=True)
class Cell:
    """One metric of one row."""

    ours: Interval
    """Over trainings"""
    published: float | None
    mark: Mark


@dataclass(frozen=True)
class StudyTable:
    """What is printed, in whatever form."""

    study: str
    title: str
    metrics: tuple[str, ...]
    rows: Mapping[str, Mapping[str, Cell]]
    """Row to metric to figures"""
    trainings: Mapping[str, int]
    real: Mapping[str, float | None]
    """Metric to its value on the real test clips"""
    source: str | None
    """Where the published figures are from"""
    agreement: Mapping[str, Interval]
    """Metric to Kendall's tau with the published order"""
    protocol: str
    unfinished: tuple[str, ...]
    recognizer: str
    """Its name"""
    second: StudyTable | None = None
    """The metrics that ask a recognizer, as a second one answers"""
    disagreement: str = ""
    """Where the orders of the rows under both differ"""

    def heading(self, metric: str) -> str:
        """As people read it."""
        return KNOWN[metric][0]

    def number(self, metric: str, value: float) -> str:
        """With the metric's decimals."""
        return f"{value:.{KNOWN[metric][1]}f}"

    def verdict(self) -> str:
        """The agreement with the paper in one sentence; empty where nothing was published."""
        parts = [
            f"{self.heading(metric)} {tau.value:+.2f}" + (f" [{tau.low:+.2f}, {tau.high:+.2f}]" if _known(tau) else "")
            for metric, tau in self.agreement.items()
            if not math.isnan(tau.value)
        ]
        if not parts:
            return ""
        return f"Kendall's tau between this order of the rows and that of {self.source}: {', '.join(parts)}."


def study_table(results: StudyResults, settings: DictConfig, title: str) -> StudyTable:
    """The table of a study.

    Args:
        results: of its rows.
        settings: `conf/study/<study>.yaml`: the metrics that it shows, and what was published.
        title: what the study asks.

    Raises:
        StudyError: a metric that does not exist.
    """
    metrics = tuple(str(metric) for metric in settings.metrics)
    for metric in metrics:
        if metric not in KNOWN:
            raise StudyError(f"study.metrics: there is no metric {metric!r}{did_you_mean(metric, KNOWN)}")
    table = _table(results, metrics, settings, title)
    second = results.second_opinion()
    if second is None:
        return table
    asked = tuple(
        metric
        for metric in metrics
        if any(results.values(row, metric) != second.values(row, metric) for row in second.rows)
    )
    if not asked:
        return table
    other = _table(second, asked, settings, title)
    return replace(table, second=other, disagreement=_disagreement((table, results), (other, second), asked))


def _table(results: StudyResults, metrics: tuple[str, ...], settings: DictConfig, title: str) -> StudyTable:
    published: Mapping[str, Any] = settings.published.rows if settings.published else {}
    # The study's file gives the order; rows that it does not name come behind.
    order = [row for row in published if row in results.rows] + [row for row in results.rows if row not in published]
    real = {metric: results.real(metric) for metric in metrics}
    rows: dict[str, dict[str, Cell]] = {row: {} for row in order}
    agreement = {}
    for metric in metrics:
        values = {row: results.values(row, metric) for row in order}
        theirs = {row: float(figures[metric]) for row, figures in published.items() if metric in figures}
        best, ties = best_and_ties(values, metric, real[metric])
        for row in order:
            mark: Mark = "best" if row == best else "tie" if row in ties else ""
            rows[row][metric] = Cell(over_trainings(values[row]), theirs.get(row), mark)
        if theirs:
            agreement[metric] = rank_agreement(values, theirs)
    trainings = {row: len(results.rows[row]) for row in order}
    source = str(settings.published.source) if settings.published else None
    return StudyTable(
        study=results.study,
        title=title,
        metrics=metrics,
        rows=rows,
        trainings=trainings,
        real=real,
        source=source,
        agreement=agreement,
        protocol=_protocol(results),
        unfinished=results.unfinished,
        recognizer=str(next(iter(results.rows.values()))[0].evaluation["recognizer"]["name"]),
    )


def _disagreement(
    first: tuple[StudyTable, StudyResults], second: tuple[StudyTable, StudyResults], metrics: Sequence[str]
) -> str:
    """In words, by the means."""
    names = [table.recognizer for table, _ in (first, second)]
    same, different = [], []
    for metric in metrics:
        heading = first[0].heading(metric)
        one, other = (
            mean_costs({row: results.values(row, metric) for row in table.rows}, metric, table.real[metric])
            for table, results in (first, second)
        )
        rows = sorted(one.keys() & other.keys(), key=lambda row: one[row])
        swapped = [
            f"{better} before {worse}".replace("_", " ")
            for better, worse in combinations(rows, 2)
            if one[better] < one[worse] and other[better] > other[worse]
        ]
        if swapped:
            different.append(f"{heading} ({names[0]} has {', '.join(swapped)})")
        else:
            same.append(heading)
    parts = [
        f"in {order} by {', '.join(headings)}"
        for order, headings in (("the same order", same), ("different orders", different))
        if headings
    ]
    return f"{names[0]} and {names[1]} put the rows {', and '.join(parts)}."


def _protocol(results: StudyResults) -> str:
    """How all of it was measured."""
    evaluation = next(iter(results.rows.values()))[0].evaluation
    recognizer = evaluation["recognizer"]
    protocol = evaluation["protocol"]
    if "seeds" in evaluation:
        judged = f"{evaluation['count']} test clips, {len(evaluation['seeds'])} generations of each"
    else:
        judged = f"{protocol['count']} sequences of {protocol['actions']} actions, {' and '.join(protocol['kinds'])}"
    run_with = f"Run with {results.changes}. " if results.changes else ""
    return (
        f"{run_with}{judged}; data {str(evaluation['data_fingerprint'])[:12]}; {recognizer['name']} "
        f"{str(recognizer['fingerprint'])[:12]} knows {recognizer['test_accuracy']:.3f} of the real test clips."
    )


def _known(interval: Interval) -> bool:
    return not math.isnan(interval.low)


def interval_text(metric: str, interval: Interval) -> str:
    """`0.370 [0.301, 0.439]`, without the ends where there is one training, a dash where there is none."""
    return decimals_text(interval, KNOWN[metric][1])


def decimals_text(interval: Interval, decimals: int) -> str:
    """The same with so many decimals."""
    if math.isnan(interval.value):
        return "-"
    text = f"{interval.value:.{decimals}f}"
    return f"{text} [{interval.low:.{decimals}f}, {interval.high:.{decimals}f}]" if _known(interval) else text


def columns_published(table: StudyTable) -> Sequence[str]:
    """The metrics that the paper gives for one of the rows."""
    return [m for m in table.metrics if any(cells[m].published is not None for cells in table.rows.values())]
