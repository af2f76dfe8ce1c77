from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
from scipy import stats

from motiongen.studies.statistics import best_and_ties, direction_of, over_trainings, rank_agreement


def test_the_interval_is_students() -> None:
    values = [0.4, 0.7, 0.55]
    interval = over_trainings(values)
    expected = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert interval.value == pytest.approx(np.mean(values))
    assert (interval.low, interval.high) == pytest.approx((expected.low, expected.high))
    # t with 2 degrees of freedom, from its closed form
    assert interval.high - interval.value == pytest.approx(4.30265 * np.std(values, ddof=1) / math.sqrt(3), rel=1e-5)


def test_one_training_has_no_interval() -> None:
    assert over_trainings([0.5]).value == 0.5
    assert math.isnan(over_trainings([0.5]).low)
    assert math.isnan(over_trainings([]).value)


def test_the_best_is_the_lowest_highest_or_nearest_to_real() -> None:
    values = {"a": [1.0, 1.1], "b": [3.0, 3.1], "c": [5.0, 5.1]}
    assert best_and_ties(values, "fid", None)[0] == "a"
    assert best_and_ties(values, "accuracy", None)[0] == "c"
    assert best_and_ties(values, "diversity", 2.9)[0] == "b"
    assert best_and_ties(values, "diversity", None) == ("", set())


def test_ties_are_what_welchs_test_does_not_tell_from_the_best() -> None:
    values = {"best": [1.0, 1.2, 1.1], "near": [1.1, 1.3, 1.15], "far": [4.0, 4.1, 4.2], "once": [1.1], "none": []}
    best, ties = best_and_ties(values, "fid", None)
    assert best == "best"
    assert ties == {"near"}


def test_tau_counts_pairs_in_the_same_order() -> None:
    values = {"a": [1.0, 1.0], "b": [2.0, 2.0], "c": [4.0, 4.0], "d": [3.0, 3.0]}
    published = {"a": 10.0, "b": 20.0, "c": 30.0, "d": 40.0, "unknown": 5.0}
    agreement = rank_agreement(values, published)
    signs = [
        np.sign(values[one][0] - values[other][0]) * np.sign(published[one] - published[other])
        for one, other in combinations(values, 2)
    ]
    assert agreement.value == pytest.approx(np.mean(signs))
    assert agreement.low == pytest.approx(agreement.value)


def test_taus_interval_is_as_wide_as_the_trainings_make_it() -> None:
    published = {"a": 1.0, "b": 2.0, "c": 3.0}
    sure = rank_agreement({"a": [1.0, 1.1], "b": [2.0, 2.1], "c": [3.0, 3.1]}, published)
    unsure = rank_agreement({"a": [1.0, 3.5], "b": [2.0, 2.1], "c": [3.0, 3.1]}, published)
    assert (sure.low, sure.high) == (1.0, 1.0)
    assert unsure.low < 1.0
    assert math.isnan(rank_agreement({"a": [1.0], "b": [2.0]}, published).low)
    assert math.isnan(rank_agreement({"a": [1.0]}, published).value)


def test_rows_that_score_the_same_have_no_order() -> None:
    alike = rank_agreement({"a": [1.0, 1.0], "b": [1.0, 1.0]}, {"a": 1.0, "b": 2.0})
    assert math.isnan(alike.value)
    assert math.isnan(alike.low)


def test_long_motions_metrics_have_the_direction_of_their_figure() -> None:
    assert [direction_of(f"overall_{figure}") for figure in ("accuracy", "fid", "pose_gap")] == [
        "higher",
        "lower",
        "real",
    ]
    assert direction_of("sufficient_motion_qr") == "higher"
