"""What the rows of a study scored along something: lengths that they were asked for, places in long motion."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from motiongen.evaluation.results import REAL
from motiongen.evaluation.stored_long import LONG_HEADINGS
from motiongen.evaluation.table import HEADINGS
from motiongen.evaluation.uncertainty import Interval
from motiongen.files import replacing
from motiongen.studies.results import GENERATED, StudyResults
from motiongen.studies.statistics import over_trainings

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANELS_A_ROW = 3

System = Mapping[str, Any]
"""What a summary holds of one system"""


@dataclass(frozen=True)
class Curves:
    """Metrics along one axis, a line a row."""

    name: str
    axis: str
    """What the axis shows, for people"""
    headings: Mapping[str, str]
    """Metric to its heading"""
    lines: Mapping[str, Mapping[str, Mapping[int, Interval]]]
    """Row, or REAL, to metric to place on the axis to the mean with its interval over trainings"""
    set_apart: frozenset[int] = frozenset()
    """Places that do not compare with the others in FID"""
    remark: str = ""


def length_curves(results: StudyResults) -> Curves | None:
    """Accuracy and FID by the frames that were asked for; None where the rows were asked for none."""
    lengths = _real(results).get("lengths")
    if not lengths:
        return None
    headings = {metric: HEADINGS[metric][0] for metric in ("accuracy", "fid")}
    apart = frozenset(int(length["frames"]) for length in lengths if not length["same_length"])
    remark = "Filled: FID to real motions of that length. Open: to all test clips, as not every action lasts that long."
    return Curves("lengths", "frames asked for", headings, _lines(results, headings, _along), apart, remark)


def place_curves(results: StudyResults, metrics: Sequence[str]) -> Curves | None:
    """Metrics of long motion along the sequence; None where the rows are of single actions."""
    if not _real(results).get("places"):
        return None
    headings = {metric: LONG_HEADINGS[metric][0] for metric in metrics}
    return Curves("places", "place in the sequence", headings, _lines(results, headings, _by_place))


def _real(results: StudyResults) -> System:
    real: System = next(iter(results.rows.values()))[0].evaluation["systems"][REAL]
    return real


def _lines(
    results: StudyResults, metrics: Iterable[str], course: Callable[[Sequence[System], str], dict[int, Interval]]
) -> dict[str, dict[str, dict[int, Interval]]]:
    systems = {REAL: [_real(results)]}
    for row, trainings in results.rows.items():
        systems[row] = [one.evaluation["systems"][GENERATED] for one in trainings]
    return {name: {metric: course(own, metric) for metric in metrics} for name, own in systems.items()}


def _by_place(systems: Sequence[System], metric: str) -> dict[int, Interval]:
    courses = zip(*(system["places"].get(metric, ()) for system in systems), strict=True)
    known = {place: [float(value) for value in own if value is not None] for place, own in enumerate(courses, start=1)}
    return {place: over_trainings(own) for place, own in known.items() if own}


def _along(systems: Sequence[System], metric: str) -> dict[int, Interval]:
    values: dict[int, list[float]] = {}
    for system in systems:
        for length in system.get("lengths", ()):
            mean = length["metrics"].get(metric, {}).get("mean")
            if mean is not None:
                values.setdefault(int(length["frames"]), []).append(float(mean))
    return {frames: over_trainings(own) for frames, own in values.items()}


def draw_curves(path: Path, curves: Curves) -> None:
    """A PNG with a panel a metric, a line a row and its interval over trainings as a band; real motion is dashed."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    columns = min(PANELS_A_ROW, len(curves.headings))
    rows = -(-len(curves.headings) // columns)
    figure = Figure(figsize=(5.2 * columns, 3.4 * rows + 0.6), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).flatten()
    for panel, (metric, heading) in zip(panels, curves.headings.items(), strict=False):
        for number, (row, metrics) in enumerate(curves.lines.items()):
            colour, dashes = ("#555555", "--") if row == REAL else (f"C{number - 1}", "-")
            apart: Set[int] = curves.set_apart if metric == "fid" else frozenset()
            _draw_line(panel, metrics[metric], apart, row.replace("_", " "), colour, dashes)
        panel.set_title(heading, fontsize=10)
        panel.set_ylim(bottom=0.0)  # what is drawn is never negative, however wide the interval of few trainings
        panel.set_xlabel(curves.axis, fontsize=9)
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
        panel.grid(alpha=0.3)
    for panel in panels[len(curves.headings) :]:
        panel.remove()
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=9)
    if curves.remark:
        figure.suptitle(curves.remark, fontsize=8, x=0.01, ha="left")
    with replacing(path) as partial:
        figure.savefig(partial, dpi=120)


def _draw_line(
    panel: Axes, points: Mapping[int, Interval], apart: Set[int], label: str, colour: str, dashes: str
) -> None:
    places, means = list(points), [point.value for point in points.values()]
    panel.plot(places, means, dashes, color=colour, linewidth=1.4, label=label)
    for fill, chosen in (("full", points.keys() - apart), ("none", points.keys() & apart)):
        some = sorted(chosen)
        panel.plot(some, [points[place].value for place in some], "o", color=colour, markersize=4, fillstyle=fill)
    if any(not math.isnan(point.low) for point in points.values()):
        low, high = zip(*((point.low, point.high) for point in points.values()), strict=True)
        panel.fill_between(places, low, high, color=colour, alpha=0.15, linewidth=0)


def curves_csv(curves: Curves) -> str:
    """One line a row, metric and place: row, metric, place, mean, low, high."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["row", "metric", curves.axis, "mean", "low", "high"])
    for row, metrics in curves.lines.items():
        for metric, points in metrics.items():
            writer.writerows([row, metric, place, one.value, one.low, one.high] for place, one in points.items())
    return text.getvalue()
