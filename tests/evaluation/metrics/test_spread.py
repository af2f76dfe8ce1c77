import math

import numpy as np
import pytest
import torch
from torch import Tensor

from motiongen.evaluation.metrics.spread import (
    diversity,
    expected_diversity,
    expected_multimodality,
    multimodality,
)
from tests.evaluation.metrics.clouds import samples, turn


def by_loops(cloud: Tensor) -> float:
    """Mean distance over all ordered pairs."""
    rows = cloud.numpy()
    return sum(float(np.linalg.norm(one - other)) for one in rows for other in rows) / len(rows) ** 2


@pytest.fixture
def tags() -> Tensor:
    """Of 60 clips: two actions, one of a single clip and one without; clips 5 to 9 have two tags."""
    tags = torch.zeros(60, 4)
    tags[:10, 0] = tags[5:59, 1] = 1
    tags[59, 2] = 1
    return tags


def test_diversity_approaches_its_expectation() -> None:
    cloud = samples(40, 6, 8)
    found = diversity(cloud, torch.Generator().manual_seed(0), pairs=100_000)
    assert found == pytest.approx(by_loops(cloud), rel=0.01)


def test_diversity_of_the_same_seed_is_the_same_number() -> None:
    cloud = samples(40, 6, 8)
    assert diversity(cloud, torch.Generator().manual_seed(3)) == diversity(cloud, torch.Generator().manual_seed(3))


def test_expected_diversity_is_the_mean_over_all_ordered_pairs() -> None:
    cloud = samples(40, 6, 8)
    assert expected_diversity(cloud) == pytest.approx(by_loops(cloud), rel=1e-9)
    # Of four ordered pairs of two clips, two are of a clip with itself.
    assert expected_diversity(torch.tensor([[0.0, 0.0], [3.0, 4.0]])) == pytest.approx(2.5, rel=1e-12)


def test_expected_diversity_ignores_order_rotation_and_offset() -> None:
    cloud = samples(40, 6, 8)
    expected = expected_diversity(cloud)
    assert expected_diversity(cloud.flip(0) @ turn(6)) == pytest.approx(expected, rel=1e-9)
    assert expected_diversity(cloud + 1e6) == pytest.approx(expected, rel=1e-6)


def test_expected_diversity_of_a_set_that_takes_several_blocks() -> None:
    # n points evenly on a line of length n - 1: sum over i, j of |i - j| / n^2 = (n^2 - 1) / (3 n).
    count = 5000
    line = torch.arange(count, dtype=torch.float64).unsqueeze(1)
    assert expected_diversity(line) == pytest.approx((count**2 - 1) / (3 * count), rel=1e-9)


@pytest.mark.parametrize("count", [0, 1])
def test_diversity_needs_two_clips(count: int) -> None:
    with pytest.raises(ValueError, match=f"at least 2 clips, not {count}"):
        diversity(torch.zeros(count, 3), torch.Generator())
    with pytest.raises(ValueError, match=f"at least 2 clips, not {count}"):
        expected_diversity(torch.zeros(count, 3))


def test_multimodality_is_the_mean_over_actions_of_the_spread_within_each(tags: Tensor) -> None:
    cloud = samples(60, 6, 9)
    # The action of one clip and the action without a clip have no spread and are left out.
    expected = (by_loops(cloud[:10]) + by_loops(cloud[5:59])) / 2
    found = multimodality(cloud, tags, torch.Generator().manual_seed(0), pairs=100_000)
    assert found == pytest.approx(expected, rel=0.01)
    assert expected_multimodality(cloud, tags) == pytest.approx(expected, rel=1e-9)
    order = torch.randperm(60, generator=torch.Generator().manual_seed(0))
    assert expected_multimodality(cloud[order] @ turn(6), tags[order]) == pytest.approx(expected, rel=1e-9)


def test_multimodality_of_actions_of_one_clip_is_nan() -> None:
    cloud, tags = samples(3, 6, 9), torch.eye(3)
    assert math.isnan(multimodality(cloud, tags, torch.Generator()))
    assert math.isnan(expected_multimodality(cloud, tags))
