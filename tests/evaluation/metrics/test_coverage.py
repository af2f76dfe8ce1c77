from collections.abc import Callable

import numpy as np
import pytest
import torch
from sklearn.neighbors import NearestNeighbors
from torch import Tensor

from motiongen.evaluation.metrics.coverage import density_coverage, precision_recall
from tests.evaluation.metrics.clouds import samples, turn


def radii(features: np.ndarray, k: int) -> np.ndarray:
    """Distance to the k-th neighbour; kneighbors without queries leaves the sample itself out."""
    distances: np.ndarray = NearestNeighbors(n_neighbors=k).fit(features).kneighbors()[0]
    return distances[:, -1]


def held(centres: np.ndarray, reach: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(points, centres) whether a ball holds a point, pair by pair."""
    return np.array(
        [[np.linalg.norm(p - c) <= r for c, r in zip(centres, reach, strict=True)] for p in points], dtype=float
    )


@pytest.fixture
def real() -> Tensor:
    return samples(60, 4, 1)


@pytest.fixture
def generated(real: Tensor) -> Tensor:
    """Near the clips on one side of the real set, and away from all of it."""
    side = real[real[:, 0] < real[:, 0].median()]
    return torch.cat([side + 0.1 * samples(len(side), 4, 0), 0.1 * samples(20, 4, 3) + 30])


@pytest.mark.parametrize("k", [1, 3, 8])
def test_precision_and_recall_are_those_of_loops_over_pairs(real: Tensor, generated: Tensor, k: int) -> None:
    one, two = real.numpy(), generated.numpy()
    precision = held(one, radii(one, k), two).any(axis=1).mean()
    recall = held(two, radii(two, k), one).any(axis=1).mean()
    assert 0 < precision < 1
    assert 0 < recall < 1
    assert precision_recall(real, generated, k) == pytest.approx((precision, recall), abs=1e-12)


@pytest.mark.parametrize("k", [1, 5, 8])
def test_density_and_coverage_are_those_of_loops_over_pairs(real: Tensor, generated: Tensor, k: int) -> None:
    one, two = real.numpy(), generated.numpy()
    holds = held(one, radii(one, k), two)
    density, coverage = holds.sum() / (k * len(two)), holds.any(axis=0).mean()
    assert density > 0
    assert 0 < coverage < 1
    assert density_coverage(real, generated, k) == pytest.approx((density, coverage), abs=1e-12)


def test_a_set_against_itself_is_perfect(real: Tensor) -> None:
    assert precision_recall(real, real) == (1.0, 1.0)
    # Exactly: the k-th neighbour lies on the ball's rim, and rounding must not let it in.
    assert density_coverage(real, real) == (1.0, 1.0)


def test_sets_that_lie_apart_share_nothing(real: Tensor) -> None:
    assert precision_recall(real, real + 1000) == (0.0, 0.0)
    assert density_coverage(real, real + 1000) == (0.0, 0.0)


def test_one_clip_over_and_over_is_precise_and_covers_little(real: Tensor) -> None:
    collapsed = real[:1].repeat(60, 1)
    assert precision_recall(real, collapsed) == pytest.approx((1.0, 1 / 60))
    # It covers as many real clips as have it among their nearest four.
    near = (torch.cdist(real, real) < torch.from_numpy(radii(real.numpy(), 5)).unsqueeze(1))[:, 0].double()
    assert density_coverage(real, collapsed) == pytest.approx((float(near.sum() / 5), float(near.mean())), abs=1e-12)


def test_neighbours_on_a_line_can_be_counted() -> None:
    real = torch.arange(10.0).unsqueeze(1)
    generated = torch.tensor([[2.4], [2.6], [50.0]])
    # k = 1: balls of radius 1. 2.4 and 2.6 lie in those around 2 and 3 each; 50 lies in none.
    assert density_coverage(real, generated, k=1) == pytest.approx((4 / 3, 2 / 10))
    # The generated balls reach 0.2, 0.2 and 47.4 far: the last from 2.6 to the right.
    assert precision_recall(real, generated, k=1) == pytest.approx((2 / 3, 7 / 10), abs=1e-6)


def test_they_ignore_order_and_a_common_rotation_and_tell_the_sets_apart(real: Tensor, generated: Tensor) -> None:
    turned, moved = real.flip(0) @ turn(4), generated.flip(0) @ turn(4)
    assert precision_recall(turned, moved) == precision_recall(real, generated)
    assert density_coverage(turned, moved) == density_coverage(real, generated)
    assert precision_recall(generated, real) == precision_recall(real, generated)[::-1]
    assert density_coverage(generated, real) != density_coverage(real, generated)


@pytest.mark.parametrize("metric", [precision_recall, density_coverage])
def test_k_neighbours_need_more_than_k_clips(metric: Callable[..., object]) -> None:
    with pytest.raises(ValueError, match="no 0-th nearest neighbour"):
        metric(torch.zeros(9, 2), torch.zeros(9, 2), k=0)
    with pytest.raises(ValueError, match="at least 5 samples"):
        metric(torch.zeros(9, 2), torch.zeros(4, 2), k=4)
    with pytest.raises(ValueError, match="equal width"):
        metric(torch.zeros(9, 2), torch.zeros(9, 3), k=4)
