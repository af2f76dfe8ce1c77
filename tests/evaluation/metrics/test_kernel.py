import numpy as np
import pytest
import torch
from sklearn.metrics.pairwise import polynomial_kernel

from motiongen.evaluation.metrics.kernel import kernel_distance
from tests.evaluation.metrics.clouds import samples, turn


def test_kid_is_that_of_sklearn_s_kernel() -> None:
    first, second = samples(40, 6, 1), samples(25, 6, 2)
    pairs = [(first, first), (second, second), (first, second)]
    own, other, across = (polynomial_kernel(*pair, degree=3, coef0=1) for pair in pairs)
    expected = across.mean() * -2
    for kernel in (own, other):
        np.fill_diagonal(kernel, np.nan)
        expected += np.nanmean(kernel)
    assert kernel_distance(first, second) == pytest.approx(expected, rel=1e-9)
    assert kernel_distance(second, first) == pytest.approx(expected, rel=1e-9)


def test_kid_of_numbers_has_a_closed_form() -> None:
    # (ab + 1)^3 over {0, 1}, different ones: 1. Over {1, 1}: 8. Across: (1 + 8) / 2.
    first, second = torch.tensor([[0.0], [1.0]]), torch.tensor([[1.0], [1.0]])
    assert kernel_distance(first, second) == pytest.approx(1 + 8 - 2 * 4.5, abs=1e-12)


def test_kid_of_sets_of_one_distribution_is_zero_on_average_whatever_their_size() -> None:
    generator = torch.Generator().manual_seed(0)
    for count in (4, 50):
        values = torch.tensor(
            [kernel_distance(*torch.randn(2, count, 3, generator=generator, dtype=torch.float64)) for _ in range(400)]
        )
        assert values.min() < 0
        assert float(values.mean()) == pytest.approx(0.0, abs=3 * float(values.std()) / 20)


def test_kid_ignores_order_rotation_and_how_the_sets_are_cut() -> None:
    first, second = samples(2500, 3, 1), samples(2000, 3, 2)
    expected = kernel_distance(first, second)
    assert expected > 0
    assert kernel_distance(first.flip(0) @ turn(3), second @ turn(3)) == pytest.approx(expected, rel=1e-9)


def test_kid_needs_two_samples_and_one_width() -> None:
    with pytest.raises(ValueError, match="KID compares two sets of at least 2 samples"):
        kernel_distance(torch.zeros(1, 4), torch.zeros(9, 4))
    with pytest.raises(ValueError, match="equal width"):
        kernel_distance(torch.zeros(9, 4), torch.zeros(9, 5))
