"""Means over trainings with intervals, ties with the best, and agreement with a published order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from scipy import stats

from motiongen.evaluation.sequences import KINDS
from motiongen.evaluation.uncertainty import Interval

Direction = Literal["higher", "lower", "real"]
LEVEL = 0.05
DRAWS = 2000
HIGHER = frozenset(
    {"accuracy", "top5_accuracy", "balanced_accuracy", "inception_score", "precision", "recall", "density", "coverage"}
    | {"motion_qr"}
)
LIKE_REAL = frozenset(
    {"diversity", "multimodality", "expected_diversity", "expected_multimodality", "joint_speed"}
    | {"nearest_training_distance", "frozen_share", "peak_jerk", "mean_jerk", "jerk_area"}
    | {"pose_gap", "velocity_gap", "seam_jerk"}
)
"""Metrics that have no better end: what is nearest to the real clips' is best."""


def direction_of(metric: str) -> Direction:
    """Which values of a metric are better; for long motion's, whatever the kind of sequences."""
    for kind in KINDS:
        metric = metric.removeprefix(f"{kind}_")
    return "higher" if metric in HIGHER else "real" if metric in LIKE_REAL else "lower"


def over_trainings(values: Sequence[float]) -> Interval:
    """The mean with its 95% interval by Student's t, which knows how few trainings there are.

    NaN for the ends where there is one training, for all where there is none.
    """
    if not values:
        return Interval(math.nan, math.nan, math.nan)
    mean = float(np.mean(values))
    if len(values) < 2:
        return Interval(mean, math.nan, math.nan)
    half = float(stats.t.ppf(1 - LEVEL / 2, len(values) - 1) * stats.sem(values))
    return Interval(mean, mean - half, mean + half)


def best_and_ties(values: Mapping[str, Sequence[float]], metric: str, real: float | None) -> tuple[str, set[str]]:
    """The row with the best mean, and those that Welch's t-test does not tell from it at 5%.

    Args:
        values: row to one value a training; rows without a value do not take part.
        metric: decides which end is better.
        real: its value on real clips, which some metrics should be near to.

    Returns:
        the best row, empty where there is none; the ties, without those of which there is one training only.
    """
    direction = direction_of(metric)
    costs = {row: _costs(own, direction, real) for row, own in values.items() if own}
    if not costs or (direction == "real" and real is None):
        return "", set()
    best = min(costs, key=lambda row: float(np.mean(costs[row])))
    ties = {row for row, own in costs.items() if row != best and _told_apart(own, costs[best]) is False}
    return best, ties


def mean_costs(values: Mapping[str, Sequence[float]], metric: str, real: float | None) -> dict[str, float]:
    """Row to a number that is the smaller the better its mean; rows without a value are left out.

    Args:
        values, metric, real: as for `best_and_ties`.
    """
    direction = direction_of(metric)
    return {row: float(np.mean(_costs(own, direction, real))) for row, own in values.items() if own}


def _costs(values: Sequence[float], direction: Direction, real: float | None) -> list[float]:
    """What is to be made small."""
    if direction == "real":
        return [abs(value - (real or 0.0)) for value in values]
    return [-value if direction == "higher" else value for value in values]


def _told_apart(one: Sequence[float], other: Sequence[float]) -> bool | None:
    """Whether the means differ; None where single trainings cannot tell."""
    if min(len(one), len(other)) < 2:
        return None
    if np.ptp(one) == np.ptp(other) == 0:
        return bool(np.mean(one) != np.mean(other))
    return bool(stats.ttest_ind(one, other, equal_var=False).pvalue < LEVEL)


def rank_agreement(values: Mapping[str, Sequence[float]], published: Mapping[str, float]) -> Interval:
    """Kendall's tau-b between the order of our means and the published one, over the rows that both have.

    The interval is the 95% percentile interval over trainings that are drawn anew within every row; NaN where a row has
    one training only. NaN for the value where fewer than two rows are common. Source: Kendall 1945; Efron and
    Tibshirani 1993, chapter 13.
    """
    rows = [row for row in published if values.get(row)]
    if len(rows) < 2:
        return Interval(math.nan, math.nan, math.nan)
    theirs = [published[row] for row in rows]
    value = _tau([float(np.mean(values[row])) for row in rows], theirs)
    if min(len(values[row]) for row in rows) < 2:
        return Interval(value, math.nan, math.nan)
    draws = np.random.default_rng(0)
    taus = [
        _tau([float(np.mean(draws.choice(values[row], len(values[row])))) for row in rows], theirs)
        for _ in range(DRAWS)
    ]
    if np.isnan(taus).all():  # every row scored the same
        return Interval(value, math.nan, math.nan)
    low, high = np.nanquantile(taus, [LEVEL / 2, 1 - LEVEL / 2])
    return Interval(value, float(low), float(high))


def _tau(ours: Sequence[float], theirs: Sequence[float]) -> float:
    return float(stats.kendalltau(ours, theirs).statistic)
