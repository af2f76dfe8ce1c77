"""An evaluation as tables: rows of text for people, the same in a terminal, in Markdown and in a tracker."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations

from motiongen.evaluation.results import REAL, Estimate, Evaluation
from motiongen.evaluation.uncertainty import Interval

TENTH = 0.1

HEADINGS = {
    "accuracy": ("accuracy", 3),
    "fid": ("FID", 3),
    "diversity": ("diversity", 3),
    "multimodality": ("multimodality", 3),
    "trajectory_error": ("trajectory error (m)", 3),
    "joint_position_error": ("joint position error (cm)", 2),
    "joint_speed": ("joint speed (m/s)", 3),
    "foot_skating": ("foot skating (cm/frame)", 3),
}
"""Metric to its column's heading and the decimals that are shown, in the table that comes first."""

FURTHER = {
    "top5_accuracy": ("top-5 accuracy", 3),
    "balanced_accuracy": ("balanced accuracy", 3),
    "inception_score": ("inception score", 2),
    "endless_fid": ("FID, extrapolated to endless N", 3),
    "kid": ("KID", 4),
    "precision": ("precision", 3),
    "recall": ("recall", 3),
    "density": ("density", 3),
    "coverage": ("coverage", 3),
    "expected_diversity": ("diversity, expected", 3),
    "expected_multimodality": ("multimodality, expected", 3),
    "nearest_training_distance": ("distance to the nearest training clip", 3),
    "frozen_share": ("share of the time frozen", 3),
    "floor_penetration": ("floor penetration (cm)", 3),
    "peak_jerk": ("peak jerk (m/s³)", 0),
    "mean_jerk": ("mean jerk (m/s³)", 0),
    "jerk_area": ("jerk area (m/s³)", 0),
}
"""The other metrics, in a table of their own with one row each."""


def metric_rows(evaluation: Evaluation) -> list[dict[str, str]]:
    """One row a system, real clips first: every metric as "mean ± 95% interval", N beside the FID."""
    rows = []
    for name, system in evaluation.systems.items():
        row = {"system": name}
        for metric, (heading, decimals) in HEADINGS.items():
            row[heading] = estimate_text(system.estimate(metric), decimals)
            if metric == "fid":
                row["N"] = str(evaluation.real_fid_count if name == REAL else system.count)
        rows.append(row)
    return rows


def further_rows(evaluation: Evaluation) -> list[dict[str, str]]:
    """One row a metric of FURTHER, one column a system, real clips first."""
    return [
        {"metric": heading}
        | {name: estimate_text(system.estimate(metric), decimals) for name, system in evaluation.systems.items()}
        for metric, (heading, decimals) in FURTHER.items()
    ]


def training_rows(evaluation: Evaluation, groups: Mapping[str, Sequence[str]]) -> list[dict[str, str]]:
    """One row a group of systems that are trainings of one composition: every metric as "mean ± interval" over them.

    The interval is 1.96 std / sqrt(n) over the n trainings, each the mean of its generation seeds.
    """
    rows = []
    for group, names in groups.items():
        row = {"composition": group, "trainings": str(len(names))}
        for metric, (heading, decimals) in (HEADINGS | FURTHER).items():
            means = tuple(evaluation.systems[name].estimate(metric).mean for name in names)
            row[heading] = estimate_text(Estimate.of(means), decimals)
        rows.append(row)
    return rows


def interval_rows(evaluation: Evaluation) -> list[dict[str, str]]:
    """One row a metric that has an interval over test clips, one column a system: "value [low, high]"."""
    return _interval_table({name: system.clips for name, system in evaluation.systems.items()})


def difference_rows(evaluation: Evaluation) -> list[dict[str, str]]:
    """The paired differences from the first system, in the same form; no rows where nothing is to compare."""
    return _interval_table({name: one.differences for name, one in evaluation.systems.items() if one.differences})


def _interval_table(columns: dict[str, dict[str, Interval]]) -> list[dict[str, str]]:
    shown = HEADINGS | FURTHER
    measured = [metric for metric in shown if any(metric in column for column in columns.values())]
    rows = []
    for metric in measured:
        heading, decimals = shown[metric]
        cells = {name: _interval(column.get(metric), decimals) for name, column in columns.items()}
        rows.append({"metric": heading} | cells)
    return rows


def length_rows(evaluation: Evaluation) -> list[dict[str, str]]:
    """One row a length that systems were asked for, accuracy and FID of each; the real clips come first."""
    rows = []
    for number, frames in enumerate(evaluation.protocol.lengths):
        row = {"frames": str(frames)}
        for name, system in evaluation.systems.items():
            if not system.lengths:
                continue
            length = system.lengths[number]
            for metric in ("accuracy",) if name == REAL else ("accuracy", "fid"):
                heading, decimals = HEADINGS[metric]
                values = length.values.get(metric)
                row[f"{heading} of {name}"] = estimate_text(Estimate.of(values), decimals) if values else "-"
            if name == REAL:
                row |= {"FID to": "this length" if length.same_length else "all test clips", "N": str(length.count)}
        rows.append(row)
    return rows


def reaction_rows(evaluation: Evaluation) -> list[dict[str, str]]:
    """One row a metric, one column a system; an arrow where the value differs from the first system's by over a tenth.

    A tenth of the first system's value or, where that is next to nothing, of the real clips' own.
    """
    first = next(name for name in evaluation.systems if name != REAL)
    rows = []
    for metric, (heading, decimals) in (HEADINGS | FURTHER).items():
        means = {name: system.estimate(metric).mean for name, system in evaluation.systems.items()}
        scale = max(abs(means[first]), abs(means[REAL]), 10**-decimals)
        row = {"metric": heading}
        for name, mean in means.items():
            gap = mean - means[first]
            arrow = "" if name == REAL or not abs(gap) > TENTH * scale else " ↑" if gap > 0 else " ↓"
            row[name] = _number(mean, decimals) + arrow
        rows.append(row)
    return rows


def action_rows(evaluation: Evaluation, system: str) -> list[dict[str, str]]:
    """One row an action: accuracy beside the real clips', speed and skating as ratios to theirs, the speed check."""
    off = evaluation.off_speed(system)
    real = evaluation.systems[REAL].actions
    return [
        {
            "action": tag,
            "N": str(action.count),
            "accuracy": _number(action.accuracy, 2),
            "real accuracy": _number(real[tag].accuracy, 2),
            "speed ratio": _number(action.speed_ratio, 2),
            "skating ratio": _number(action.skating_ratio, 2),
            "speed check": "off" if tag in off else "ok",
        }
        for tag, action in evaluation.systems[system].actions.items()
    ]


def markdown(rows: list[dict[str, str]]) -> str:
    """Rows with the same columns as a Markdown table whose columns also line up as plain text."""
    columns = list(rows[0])
    widths = [max(len(column), *(len(row[column]) for row in rows)) for column in columns]
    lines = [columns, ["-" * width for width in widths], *([row[column] for column in columns] for row in rows)]
    return "\n".join(
        "| " + " | ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)) + " |" for line in lines
    )


def footnote(evaluation: Evaluation) -> str:
    """What a reader has to know to believe the table."""
    protocol = evaluation.protocol
    return (
        f"{evaluation.count} test clips (long ones cut into windows), "
        f"generation seeds {list(protocol.generation_seeds)}; mean ± 1.96 std / sqrt(n) over seeds. "
        f"{evaluation.recognizer} {evaluation.recognizer_fingerprint[:12]} knows "
        f"{evaluation.recognizer_accuracy:.3f} of the real test clips. FID of systems against the "
        f"{evaluation.count} real test clips, of real test clips against "
        f"{evaluation.real_fid_count} training clips."
    )


def report(evaluation: Evaluation) -> str:
    """All tables of one evaluation but the actions', with what has to be known to read them."""
    differences = difference_rows(evaluation)
    first = next((name for name in evaluation.systems if name != REAL), REAL)
    parts = [
        markdown(metric_rows(evaluation)),
        footnote(evaluation),
        *(f"Warning: {text}." for text in evaluation.warnings()),
        markdown(further_rows(evaluation)),
        f"95% intervals over test clips ({evaluation.takes} takes, drawn anew; for the FID left out in turn):",
        markdown(interval_rows(evaluation)),
    ]
    if evaluation.protocol.lengths:
        parts += ["Asked for other lengths:", markdown(length_rows(evaluation))]
    if differences:
        parts += [f"Paired differences from {first}, with their 95% intervals over test clips:", markdown(differences)]
    return "\n\n".join(parts)


def disagreements(one: Evaluation, other: Evaluation) -> list[str]:
    """Pairs of systems that two recognizers order differently, in words, for accuracy and FID."""
    found = []
    names = [name for name in one.systems if name != REAL]
    for metric in ("accuracy", "fid"):
        for first, second in combinations(names, 2):
            gaps = [
                evaluation.systems[first].estimate(metric).mean - evaluation.systems[second].estimate(metric).mean
                for evaluation in (one, other)
            ]
            if gaps[0] * gaps[1] < 0:
                found.append(
                    f"{HEADINGS[metric][0]} of {first} and {second}: {gaps[0]:+.3f} under {one.recognizer}, "
                    f"{gaps[1]:+.3f} under {other.recognizer}"
                )
    return found


def estimate_text(estimate: Estimate, decimals: int) -> str:
    """`mean ± interval`, or a dash for what could not be measured."""
    if math.isnan(estimate.mean):
        return "-"
    mean = f"{estimate.mean:.{decimals}f}"
    return mean if math.isnan(estimate.interval) else f"{mean} ± {estimate.interval:.{decimals}f}"


def _interval(interval: Interval | None, decimals: int) -> str:
    if interval is None or math.isnan(interval.value):
        return "-"
    text = f"{interval.value:.{decimals}f}"
    return text if math.isnan(interval.low) else f"{text} [{interval.low:.{decimals}f}, {interval.high:.{decimals}f}]"


def _number(value: float, decimals: int) -> str:
    return "-" if math.isnan(value) else f"{value:.{decimals}f}"
