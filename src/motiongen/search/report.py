"""What a search found: its trials, the best of them, which parameters mattered, as files."""

from __future__ import annotations

import csv
import json
import logging
import math
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from motiongen.evaluation.table import markdown
from motiongen.files import replacing
from motiongen.search.objectives import RECOGNIZER_ACCURACY
from motiongen.search.search import OVERRIDES, REASON, REFUSED, Search

if TYPE_CHECKING:
    from optuna.trial import FrozenTrial

ENOUGH = 4
"""Finished trials below which nothing can be said about parameters."""
SEARCH_ONLY = ("+search=", "hydra", "seed=", "data.validation_share=")
"""Overrides that the search has, and not what is trained with its result."""
_log = logging.getLogger(__name__)


def write_report(search: Search, base: Sequence[str]) -> list[Path]:
    """`trials.csv`, `report.md`, and pictures where there is something to see. Prints the report.

    Args:
        search: with its trials.
        base: what every trial's command line has.

    Returns:
        the files.
    """
    trials = search.trials()
    paths = [search.folder / "trials.csv", search.folder / "report.md"]
    _write_trials(paths[0], search, trials)
    text = report(search, trials, base)
    with replacing(paths[1]) as partial:
        partial.write_text(text, encoding="utf-8")
    print(text)
    finished = [one for one in trials if one.values is not None]
    if len(search.objectives) > 1 and finished:
        paths.append(search.folder / "pareto.png")
        draw_pareto(paths[-1], search, finished)
    if len(finished) >= ENOUGH:
        paths += _drawn_importances(search)
    return paths


def _afterwards(search: Search, overrides: str) -> list[str]:
    """How to go on with the best."""
    if RECOGNIZER_ACCURACY in search.objectives:
        return ["The first of them, judged on the test clips:", f"    python -m motiongen {overrides}"]
    return [
        "The first of them with three seeds, judged on the test clips:",
        f"    python -m motiongen -m {overrides} seed=0,1,2",
    ]


def report(search: Search, trials: Sequence[FrozenTrial], base: Sequence[str]) -> str:
    """The counts, the best trials, and the command that trains one of them again with several seeds."""
    counts = dict.fromkeys(("complete", "pruned", "fail", "running", "waiting"), 0)
    for one in trials:
        counts[one.state.name.lower()] += 1
    refused = [one for one in trials if REFUSED in one.user_attrs]
    failed = [one for one in trials if REASON in one.user_attrs]
    best = sorted(search.study.best_trials, key=lambda one: one.values)
    rows = [
        {"trial": str(one.number)}
        | {name: f"{value:.3f}" for name, value in zip(search.objectives, one.values, strict=True)}
        | {"overrides": " ".join(one.user_attrs[OVERRIDES])}
        for one in best
    ]
    parts = [
        f"# Search {search.study.study_name}",
        f"{counts['complete']} trials finished, {counts['pruned']} were pruned, {len(failed)} failed, "
        f"{len(refused)} compositions were refused before they cost anything, {counts['running']} are running.",
    ]
    if rows:
        kind = "The Pareto set" if len(search.objectives) > 1 else "The best"
        kept = [text for text in base if not text.startswith(SEARCH_ONLY)]
        again = " ".join(_quoted(text) for text in (*kept, *best[0].user_attrs[OVERRIDES]))
        parts += [
            f"{kind} on the held-out clips, by {', '.join(f'{n} ({d})' for n, d in search.objectives.items())}:",
            markdown(rows),
            *_afterwards(search, again),
        ]
    if failed:
        parts.append("\n".join(f"- trial {one.number} failed: {_line(one.user_attrs[REASON])}" for one in failed))
    return "\n\n".join(parts) + "\n"


def draw_pareto(path: Path, search: Search, trials: Sequence[FrozenTrial]) -> None:
    """The first two objectives of every finished trial, the Pareto set marked, the third as colour."""
    from matplotlib.figure import Figure

    names = list(search.objectives)
    best = {one.number for one in search.study.best_trials}
    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.subplots()
    columns = list(zip(*(one.values for one in trials), strict=True))
    colours = columns[2] if len(names) > 2 else ["#1f5fa8"] * len(trials)
    points = axes.scatter(columns[0], columns[1], c=colours, s=30, label="trials")
    marked = [one for one in trials if one.number in best]
    axes.scatter(
        [one.values[0] for one in marked],
        [one.values[1] for one in marked],
        s=110,
        facecolors="none",
        edgecolors="#c0562a",
        label="Pareto set",
    )
    for one in marked:
        axes.annotate(f" {one.number}", one.values[:2])
    if len(names) > 2:
        figure.colorbar(points, label=names[2])
    axes.set_xlabel(f"{names[0]} ({search.objectives[names[0]]})")
    axes.set_ylabel(f"{names[1]} ({search.objectives[names[1]]})")
    axes.legend()
    figure.savefig(path, dpi=120)


def _drawn_importances(search: Search) -> list[Path]:
    """One picture with the importance of every parameter for every objective; none where Optuna cannot tell."""
    from matplotlib.figure import Figure
    from optuna.importance import PedAnovaImportanceEvaluator, get_param_importances

    figure = Figure(figsize=(4.5 * len(search.objectives), 4), layout="constrained")
    panels = figure.subplots(1, len(search.objectives), squeeze=False)[0]
    for index, (panel, name) in enumerate(zip(panels, search.objectives, strict=True)):
        try:
            with warnings.catch_warnings(action="ignore"):
                found = get_param_importances(
                    search.study, evaluator=PedAnovaImportanceEvaluator(), target=_value_of(index)
                )
        except (ValueError, RuntimeError) as error:
            _log.info("No importances: %s", error)
            return []
        panel.barh(list(found)[::-1], [0.0 if math.isnan(share) else share for share in found.values()][::-1])
        panel.set_title(f"importance for {name.replace('_', ' ')}", fontsize=10)
    path = search.folder / "importance.png"
    figure.savefig(path, dpi=120)
    return [path]


def _value_of(objective: int) -> Callable[[FrozenTrial], float]:
    return lambda trial: float(trial.values[objective])


def _write_trials(path: Path, search: Search, trials: Sequence[FrozenTrial]) -> None:
    parameters = list(search.space.distributions)
    with replacing(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["trial", "state", *search.objectives, *parameters, "reason", "intermediate"])
        for one in trials:
            values = one.values or [""] * len(search.objectives)
            reason = _line(one.user_attrs.get(REFUSED, one.user_attrs.get(REASON, "")))
            chosen = [one.params.get(name, "") for name in parameters]
            row = [one.number, one.state.name.lower(), *values, *chosen, reason, json.dumps(one.intermediate_values)]
            writer.writerow(row)


def _line(text: str) -> str:
    return text.splitlines()[0] if text else ""


def _quoted(text: str) -> str:
    return f"'{text}'" if set(text) & set("[](){}, *") else text
