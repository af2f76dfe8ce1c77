import numpy as np
import pytest
import scipy.linalg
import torch
from torch import Tensor

from motiongen.evaluation.metrics.distribution import diversity, frechet_distance, multimodality


def samples(count: int, width: int, seed: int) -> Tensor:
    generator = torch.Generator().manual_seed(seed)
    mixing = torch.randn(width, width, generator=generator, dtype=torch.float64)
    return torch.randn(count, width, generator=generator, dtype=torch.float64) @ mixing + seed


def test_fid_is_that_of_the_product_s_matrix_root() -> None:
    first, second = samples(200, 12, 1), samples(150, 12, 2)
    one, two = np.cov(first.numpy(), rowvar=False), np.cov(second.numpy(), rowvar=False)
    mean = np.square(first.numpy().mean(0) - second.numpy().mean(0)).sum()
    expected = mean + np.trace(one + two - 2 * scipy.linalg.sqrtm(one @ two).real)
    assert frechet_distance(first, second) == pytest.approx(expected, rel=1e-9)


def test_fid_of_a_shift_and_a_scale_has_a_closed_form() -> None:
    cloud = samples(100, 5, 3)
    assert frechet_distance(cloud, cloud + 2.0) == pytest.approx(5 * 4.0, rel=1e-9)
    # Covariances C and 4 C: tr(C + 4 C - 2 * 2 C) = tr(C).
    centred = cloud - cloud.mean(dim=0)
    assert frechet_distance(centred, 2 * centred) == pytest.approx(float(centred.T.cov().trace()), rel=1e-9)


@pytest.mark.parametrize("count", [2, 10, 300])
def test_fid_of_a_set_with_itself_is_zero_also_with_fewer_samples_than_features(count: int) -> None:
    cloud = samples(count, 64, 4)
    assert frechet_distance(cloud, cloud) == pytest.approx(0.0, abs=1e-9 * float(cloud.var(dim=0).sum()))


def test_fid_is_symmetric_and_ignores_order_and_a_common_rotation_when_rank_deficient() -> None:
    first, second = samples(20, 64, 5), samples(30, 64, 6)
    turn = torch.linalg.qr(samples(64, 64, 7)).Q
    reference = frechet_distance(first, second)
    assert frechet_distance(second, first) == pytest.approx(reference, rel=1e-9)
    assert frechet_distance(first.flip(0) @ turn, second @ turn) == pytest.approx(reference, rel=1e-9)


def test_fid_needs_two_samples() -> None:
    with pytest.raises(ValueError, match="at least 2"):
        frechet_distance(torch.zeros(1, 4), torch.zeros(9, 4))


def test_diversity_approaches_the_mean_over_all_ordered_pairs() -> None:
    cloud = samples(40, 6, 8)
    expected = float(torch.cdist(cloud, cloud).mean())
    found = diversity(cloud, torch.Generator().manual_seed(0), pairs=100_000)
    assert found == pytest.approx(expected, rel=0.01)


def test_diversity_of_the_same_seed_is_the_same_number() -> None:
    cloud = samples(40, 6, 8)
    assert diversity(cloud, torch.Generator().manual_seed(3)) == diversity(cloud, torch.Generator().manual_seed(3))


def test_multimodality_is_the_mean_over_actions_of_the_spread_within_each() -> None:
    cloud = samples(60, 6, 9)
    tags = torch.zeros(60, 4)
    tags[:10, 0] = tags[10:59, 1] = 1
    tags[59, 2] = 1
    # The action of one clip and the action without a clip have no spread and are left out.
    spreads = [torch.cdist(group, group).mean() for group in (cloud[:10], cloud[10:59])]
    found = multimodality(cloud, tags, torch.Generator().manual_seed(0), pairs=100_000)
    assert found == pytest.approx(float(sum(spreads) / 2), rel=0.01)
