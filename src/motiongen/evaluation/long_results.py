"""What an evaluation of long motion found: means over the actions behind the first, curves along the sequence."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from motiongen.evaluation.long_motion import LongJudgement
from motiongen.evaluation.metrics.classification import hits
from motiongen.evaluation.metrics.frechet import frechet_distance
from motiongen.evaluation.results import Estimate
from motiongen.evaluation.uncertainty import Interval, bootstrap

COLUMNS = {
    "accuracy": ("accuracy", 3),
    "fid": ("FID", 2),
    "pose_gap": ("pose gap (cm)", 2),
    "velocity_gap": ("velocity gap (cm/frame)", 2),
    "seam_jerk": ("jerk at seams (m/s³)", 0),
    "foot_skating": ("foot skating (cm/frame)", 2),
    "floor_gap": ("off the floor (cm)", 1),
    "frozen_share": ("share of the time frozen", 3),
    "motion_qr": ("motion QR", 3),
}
"""Figure to its column's heading and the decimals that are shown."""
PREFIXES = ("", "second_")
"""Of what is kept under the first recognizer, and under a second one."""
DRAWS = 1000


@dataclass(frozen=True)
class LongResult:
    """One system's figures on one set of sequences."""

    figures: dict[str, Interval]
    """Means over all actions but the first of every motion, whose initial frames are recorded, with the 95% interval
    over motions; FID over all their parts and without an interval; motion QR of all of a motion's actions"""
    parts: int
    """N of the FID"""
    curves: dict[str, list[float]]
    """Figure to its mean for every place in the sequence; `action_qr` and `motion_qr` of all actions up to there"""


def summarized(judged: LongJudgement, reference: Tensor, seed: int = 0) -> LongResult:
    """The figures of one system; `reference` (R, E): features of the real test clips, for FID."""
    recognized = hits(judged.logits, judged.tags).double()
    columns = {"accuracy": recognized, **judged.values}
    later = judged.index > 0
    draws = torch.Generator()
    figures = {
        name: bootstrap(values[later], judged.sequence[later], DRAWS, draws.manual_seed(seed))
        for name, values in columns.items()
    }
    parts = judged.features[judged.part_index > 0]
    fid = frechet_distance(parts, reference)
    figures["fid"] = Interval(fid, torch.nan, torch.nan)
    matrix = recognized.view(-1, int(judged.index.max()) + 1)
    whole = matrix[:, 1:].prod(dim=1)
    figures["motion_qr"] = bootstrap(whole, torch.arange(len(whole)), DRAWS, draws.manual_seed(seed))
    return LongResult(figures, len(parts), _curves(judged, columns, matrix, reference))


def _curves(
    judged: LongJudgement, columns: Mapping[str, Tensor], matrix: Tensor, reference: Tensor
) -> dict[str, list[float]]:
    places = range(matrix.shape[1])
    curves = {
        name: [float(values[judged.index == place].nanmean()) for place in places] for name, values in columns.items()
    }
    curves["fid"] = [frechet_distance(judged.features[judged.part_index == place], reference) for place in places]
    curves["action_qr"] = [float(matrix[:, : place + 1].mean()) for place in places]
    curves["motion_qr"] = [float(matrix[:, : place + 1].prod(dim=1).mean()) for place in places]
    return curves


def long_rows(results: Mapping[str, LongResult]) -> list[dict[str, str]]:
    """One row a system: every figure with its interval over motions."""
    rows = []
    for name, result in results.items():
        row = {"system": name}
        for figure, (heading, decimals) in COLUMNS.items():
            found = result.figures[figure]
            row[heading] = f"{found.value:.{decimals}f}"
            if math.isfinite(found.low):
                row[heading] += f" [{found.low:.{decimals}f}, {found.high:.{decimals}f}]"
            if figure == "fid":
                row["N"] = str(result.parts)
        rows.append(row)
    return rows


def long_training_rows(results: Mapping[str, LongResult], groups: Mapping[str, Sequence[str]]) -> list[dict[str, str]]:
    """One row a group of systems that are trainings of one composition: mean ± 1.96 std / sqrt(n) over them."""
    rows = []
    for group, names in groups.items():
        row = {"system": group, "trainings": str(len(names))}
        for figure, (heading, decimals) in COLUMNS.items():
            found = Estimate.of(tuple(results[name].figures[figure].value for name in names))
            interval = f" ± {found.interval:.{decimals}f}" if math.isfinite(found.interval) else ""
            row[heading] = f"{found.mean:.{decimals}f}{interval}"
        rows.append(row)
    return rows


def long_scalars(results: Mapping[str, LongResult]) -> dict[str, float]:
    """Flat names to numbers for a tracker: "marionette-s0/pure/accuracy". Finite values only."""
    flat = {
        f"{name.replace(', ', '/')}/{figure}": own.value
        for name, result in results.items()
        for figure, own in result.figures.items()
    }
    return {name: value for name, value in flat.items() if math.isfinite(value)}


def to_json(result: LongResult) -> dict[str, Any]:
    """Plain values; None for what could not be measured."""
    return {
        "figures": {
            name: {"value": _plain(own.value), "low": _plain(own.low), "high": _plain(own.high)}
            for name, own in result.figures.items()
        },
        "parts": result.parts,
        "curves": {name: [_plain(value) for value in own] for name, own in result.curves.items()},
    }


def _plain(value: float) -> float | None:
    return value if math.isfinite(value) else None


def curve_rows(results: Mapping[str, LongResult]) -> list[dict[str, str]]:
    """One row for every figure and system, one column for every place in the sequence."""
    rows = []
    for figure in next(iter(results.values())).curves:
        for name, result in results.items():
            values = {str(place): f"{value:.3f}" for place, value in enumerate(result.curves[figure], start=1)}
            rows.append({"figure": figure, "system": name} | values)
    return rows
