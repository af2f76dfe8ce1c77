import numpy as np
import pytest
import scipy.linalg
import torch
from torch import Tensor

from motiongen.evaluation.metrics.frechet import (
    FeatureMoments,
    extrapolated_frechet_distance,
    frechet_distance,
    frechet_distance_of_moments,
)
from tests.evaluation.metrics.clouds import samples, turn


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
    reference = frechet_distance(first, second)
    assert frechet_distance(second, first) == pytest.approx(reference, rel=1e-9)
    assert frechet_distance(first.flip(0) @ turn(64), second @ turn(64)) == pytest.approx(reference, rel=1e-9)


def test_fid_between_sets_with_more_and_with_fewer_samples_than_features() -> None:
    """Of diagonal covariances: sum of (s - t)^2 over the axes, where the smaller set has no spread along most."""
    scales = torch.arange(1, 9, dtype=torch.float64)
    corners = torch.cat([torch.eye(8, dtype=torch.float64), -torch.eye(8, dtype=torch.float64)])
    wide, narrow = corners * scales, corners[[0, 1, 8, 9]] * scales
    axes = torch.tensor([2 / 15, 2 / 3], dtype=torch.float64).sqrt().outer(scales)
    axes[1, 2:] = 0
    expected = float((axes[0] - axes[1]).square().sum())
    rotation = turn(8)
    # Where there is no spread, rounding of 1e-16 is 1e-8 in the root.
    assert frechet_distance(wide @ rotation, narrow @ rotation) == pytest.approx(expected, rel=1e-8)


def test_fid_needs_two_samples_and_one_width() -> None:
    with pytest.raises(ValueError, match=r"at least 2 .* not \(1, 4\) and \(9, 4\)"):
        frechet_distance(torch.zeros(1, 4), torch.zeros(9, 4))
    with pytest.raises(ValueError, match=r"equal width, not \(9, 4\) and \(9, 5\)"):
        frechet_distance(torch.zeros(9, 4), torch.zeros(9, 5))


def test_moments_are_numpy_s() -> None:
    cloud = samples(50, 6, 1)
    moments = FeatureMoments.of(cloud.float())
    assert moments.count == 50
    assert moments.comoment.dtype == torch.float64
    exact = cloud.float().double().numpy()
    np.testing.assert_allclose(moments.mean, exact.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(moments.covariance, np.cov(exact, rowvar=False), rtol=1e-10)


@pytest.mark.parametrize("batches", [[0, 50], [1, 49], [7, 0, 13, 1, 29]])
def test_moments_of_a_stream_are_those_of_the_whole_set(batches: list[int]) -> None:
    cloud = samples(50, 6, 1)
    parts = cloud.split(batches)
    stream = FeatureMoments.of(parts[0])
    for part in parts[1:]:
        stream = stream.update(part)
    half = len(parts) // 2
    left, right = FeatureMoments.of(torch.cat(parts[:half])), FeatureMoments.of(torch.cat(parts[half:]))
    whole = FeatureMoments.of(cloud)
    for found in (stream, left.merge(right), right.merge(left)):
        assert found.count == 50
        torch.testing.assert_close(found.mean, whole.mean, rtol=1e-12, atol=0)
        torch.testing.assert_close(found.comoment, whole.comoment, rtol=1e-10, atol=1e-10)
    reference = FeatureMoments.of(samples(40, 6, 2))
    expected = frechet_distance(cloud, samples(40, 6, 2))
    assert frechet_distance_of_moments(stream, reference) == pytest.approx(expected, rel=1e-9)


def test_a_far_offset_costs_a_stream_no_digits() -> None:
    # A sum of squares minus a squared sum would lose all of the variance, 16 digits below the offset's square.
    cloud = samples(200, 3, 0)
    stream = FeatureMoments.of(torch.empty(0, 3))
    for part in (cloud + 1e8).split(20):
        stream = stream.update(part)
    torch.testing.assert_close(stream.covariance, cloud.T.cov(), rtol=1e-6, atol=1e-6)


def test_updating_moments_leaves_them_as_they_are() -> None:
    first, second = samples(10, 3, 1), samples(10, 3, 2)
    moments = FeatureMoments.of(first)
    moments.update(second)
    assert moments.count == 10
    assert torch.equal(moments.comoment, FeatureMoments.of(first).comoment)


def test_moments_of_another_shape_are_refused() -> None:
    moments = FeatureMoments.of(torch.zeros(5, 4))
    with pytest.raises(ValueError, match="width 4 and 3"):
        moments.update(torch.zeros(5, 3))
    with pytest.raises(ValueError, match=r"not \(4,\)"):
        moments.update(torch.zeros(4))
    with pytest.raises(ValueError, match=r"not \(5, 4\) and \(5, 3\)"):
        frechet_distance_of_moments(moments, FeatureMoments.of(torch.zeros(5, 3)))


def exact_reference(width: int) -> Tensor:
    """Samples whose own mean is 0 and whose own covariance is 1, so that a reference has no bias of its size."""
    cloud = torch.randn(4 * width, width, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    values, vectors = torch.linalg.eigh(cloud.T.cov())
    return (cloud - cloud.mean(dim=0)) @ vectors / values.sqrt()


def standard_error(values: list[float]) -> float:
    return float(torch.tensor(values).std()) / len(values) ** 0.5


@pytest.mark.parametrize(("shift", "scale"), [(0.0, 1.0), (0.5, 2.0)])
def test_extrapolated_fid_has_no_bias(shift: float, scale: float) -> None:
    width, count = 16, 1000
    reference = exact_reference(width)
    # Gaussians with means 0 and `shift`, covariances 1 and scale^2.
    truth = width * (shift**2 + (scale - 1) ** 2)
    generator = torch.Generator().manual_seed(1)
    plain, extrapolated = [], []
    for _ in range(20):
        features = scale * torch.randn(count, width, generator=generator, dtype=torch.float64) + shift
        plain.append(frechet_distance(features, reference))
        extrapolated.append(extrapolated_frechet_distance(features, reference, generator))
    # The bias of 1000 samples, by expanding the root of a Wishart matrix around its mean to second order.
    bias = scale**2 * width / count + scale * (width**2 + width) / (4 * count)
    assert sum(plain) / 20 - truth == pytest.approx(bias, rel=0.1, abs=3 * standard_error(plain))
    assert sum(extrapolated) / 20 == pytest.approx(truth, abs=3 * standard_error(extrapolated))
    if shift == 0:
        assert 3 * standard_error(extrapolated) < 0.2 * bias


def test_extrapolated_fid_is_drawn_from_the_generator_alone_and_ignores_a_rotation() -> None:
    features, reference = samples(120, 4, 1), samples(60, 4, 2)

    def found(seed: int, first: Tensor = features, second: Tensor = reference) -> float:
        return extrapolated_frechet_distance(
            first, second, torch.Generator().manual_seed(seed), points=5, smallest=0.25
        )

    assert found(3) == found(3)
    assert found(3) != found(4)
    assert found(3, features @ turn(4), reference @ turn(4)) == pytest.approx(found(3), rel=1e-9)
    # Two sizes make the line exact: one through the FID of all samples and that of a half.
    half = features[torch.randperm(120, generator=torch.Generator().manual_seed(0))[:60]]
    whole = frechet_distance(features, reference)
    generator = torch.Generator().manual_seed(0)
    line = extrapolated_frechet_distance(features, reference, generator, points=2, smallest=0.5)
    assert line == pytest.approx(2 * whole - frechet_distance(half, reference), rel=1e-9)


@pytest.mark.parametrize(("points", "smallest"), [(1, 0.1), (15, 0.01), (15, 1.0), (15, 1.5)])
def test_extrapolated_fid_needs_a_line(points: int, smallest: float) -> None:
    features, generator = samples(50, 3, 1), torch.Generator()
    with pytest.raises(ValueError, match=f"no line goes through {points} subsets"):
        extrapolated_frechet_distance(features, features, generator, points, smallest)
