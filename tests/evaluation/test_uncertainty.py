from __future__ import annotations

import math

import pytest
import torch

from motiongen.evaluation.uncertainty import Interval, bootstrap, jackknife

ALONE = torch.arange(400)


def draws() -> torch.Generator:
    return torch.Generator().manual_seed(0)


def test_the_bootstrap_of_independent_clips_is_the_normal_interval() -> None:
    values = torch.randn(400, generator=draws()).double()
    found = bootstrap(values, ALONE, 20000, draws())
    half = 1.96 * float(values.std(correction=0)) / math.sqrt(400)
    assert found.value == pytest.approx(float(values.mean()))
    assert found.high - found.value == pytest.approx(half, rel=0.05)
    assert found.value - found.low == pytest.approx(half, rel=0.05)


def test_clips_of_one_take_count_as_one() -> None:
    """Ten copies of every clip say nothing new, so that the interval stays as wide as that of one of each."""
    values, takes = torch.randn(40, generator=draws()).double(), torch.arange(40)
    once = bootstrap(values, takes, 4000, draws())
    copied = bootstrap(values.repeat_interleave(10), takes.repeat_interleave(10), 4000, draws())
    assert (copied.value, copied.low, copied.high) == pytest.approx((once.value, once.low, once.high))


def test_clips_without_a_value_are_left_out() -> None:
    values = torch.tensor([1.0, math.nan, 3.0, math.nan])
    assert bootstrap(values, torch.tensor([0, 0, 1, 1]), 100, draws()).value == 2.0
    nothing = bootstrap(torch.full((4,), math.nan), torch.tensor([0, 0, 1, 1]), 100, draws())
    assert all(map(math.isnan, (nothing.value, nothing.low, nothing.high)))


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    values = torch.randn(400, generator=draws()).double()
    found = jackknife(lambda kept: float(values[kept].mean()), ALONE, 400)
    assert found.high - found.value == pytest.approx(1.96 * float(values.std()) / math.sqrt(400), rel=1e-6)
    grouped = jackknife(lambda kept: float(values[kept].mean()), ALONE, 20)
    assert grouped.high - grouped.value == pytest.approx(found.high - found.value, rel=0.4)


def test_one_take_has_no_interval() -> None:
    found = jackknife(lambda kept: 1.0, torch.zeros(5, dtype=torch.long), 20)
    assert found.value == 1.0
    assert math.isnan(found.low)
    assert Interval(1.0, 1.0, 1.0) == bootstrap(torch.ones(5), torch.zeros(5, dtype=torch.long), 10, draws())
