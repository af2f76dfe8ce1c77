import pytest

from motiongen.evaluation.results import Estimate


def test_the_interval_is_1_96_standard_errors() -> None:
    # Sample standard deviation of 1..5 is sqrt(2.5).
    estimate = Estimate.of((1.0, 2.0, 3.0, 4.0, 5.0))
    assert estimate.mean == 3.0
    assert estimate.interval == pytest.approx(1.96 * 2.5**0.5 / 5**0.5, rel=1e-12)


def test_one_seed_has_no_interval() -> None:
    estimate = Estimate.of((0.25,))
    assert estimate.mean == 0.25
    assert estimate.interval != estimate.interval
