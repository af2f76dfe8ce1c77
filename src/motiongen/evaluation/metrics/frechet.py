"""The Frechet distance between two sets of recognizer features: at once, from streams, and without its bias."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import torch
from torch import Tensor


@dataclass(frozen=True)
class FeatureMoments:
    """Count, mean and co-moments of a set of features, all that the Frechet distance needs of it.

    A set that does not fit into memory is taken batch by batch: `moments = moments.update(batch)`, from
    `FeatureMoments.of(first_batch)`; sets that were counted apart are merged. Both give what the whole set at once
    would, up to rounding in float64, as every co-moment is about its own mean. Source: Chan, Golub and LeVeque 1983.
    """

    count: int
    """N"""
    mean: Tensor
    """(E,) float64"""
    comoment: Tensor
    """(E, E) float64: the sum over samples of (x - mean)(x - mean)^T, N - 1 times the covariance."""

    @classmethod
    def of(cls, features: Tensor) -> Self:
        """The moments of features (N, E); N may be 0.

        Raises:
            ValueError: features of another number of dimensions.
        """
        if features.ndim != 2:
            raise ValueError(f"features have shape (N, E), not {tuple(features.shape)}")
        features = features.double()
        mean = features.sum(dim=0) / max(len(features), 1)
        centred = features - mean
        return cls(len(features), mean, centred.T @ centred)

    def update(self, features: Tensor) -> Self:
        """The moments with further samples (N, E) among them. These here stay as they are.

        Raises:
            ValueError: features of another shape.
        """
        return self.merge(type(self).of(features))

    def merge(self, other: Self) -> Self:
        """The moments of both sets together.

        Raises:
            ValueError: moments of another width.
        """
        if self.mean.shape != other.mean.shape:
            raise ValueError(f"features of width {len(self.mean)} and {len(other.mean)} are no one set")
        count = self.count + other.count
        weight = other.count / max(count, 1)
        shift = other.mean - self.mean
        between = self.count * weight * torch.outer(shift, shift)
        return type(self)(count, self.mean + weight * shift, self.comoment + other.comoment + between)

    @property
    def covariance(self) -> Tensor:
        """(E, E) with N - 1; meaningless for fewer than two samples."""
        return self.comoment / (self.count - 1)


def frechet_distance(first: Tensor, second: Tensor) -> float:
    """Frechet Inception Distance between two sets of features (N, E) and (M, E).

    |mu_1 - mu_2|^2 + tr(C_1 + C_2 - 2 (C_1 C_2)^(1/2)), covariances with N - 1. Unit: squared feature units. Range 0 to
    infinity, lower is better. Biased upwards by about 1/N, so only values of equal N compare. Source: Heusel et al.
    2017, Eq. 6, as in Action2Motion and Neural Marionette (section 5.1.2).

    Raises:
        ValueError: a set of fewer than two samples, or of another width than the other.
    """
    return frechet_distance_of_moments(FeatureMoments.of(first), FeatureMoments.of(second))


def frechet_distance_of_moments(one: FeatureMoments, other: FeatureMoments) -> float:
    """`frechet_distance` of sets of which only the moments are at hand.

    The trace of the root is the sum of the singular values of R_1^T R_2, where R R^T = C: in float64 it is exact also
    for fewer samples than features, where a root of the product C_1 C_2 is not.

    Raises:
        ValueError: a set of fewer than two samples, or of another width than the other.
    """
    if min(one.count, other.count) < 2 or one.mean.shape != other.mean.shape:
        shapes = " and ".join(str((moments.count, len(moments.mean))) for moments in (one, other))
        raise ValueError(f"FID compares two sets of at least 2 samples and of equal width, not {shapes}")
    first, second = one.covariance, other.covariance
    cross = torch.linalg.svdvals(_factor(first).T @ _factor(second)).sum()
    spread = first.trace() + second.trace() - 2 * cross
    return max(float((one.mean - other.mean).square().sum() + spread), 0.0)


def extrapolated_frechet_distance(
    features: Tensor, reference: Tensor, generator: torch.Generator, points: int = 15, smallest: float = 0.1
) -> float:
    """FID at infinitely many generated clips: the intercept of a line through FIDs of subsets, over 1/N.

    features (N, E) are resampled: for each of `points` sizes, evenly spaced from `smallest` N to N, one subset is drawn
    without replacement, independently of the others. reference (M, E) is fixed, so the bias of its own size remains,
    alike for every system that is compared with it. The bias is a line in 1/N only for subsets of more samples than
    features; `smallest` N below several E extrapolates a curve. Unit: squared feature units. Range about 0 to infinity,
    a little below 0 by chance; lower is better. Source: Chong and Forsyth 2020, with their 15 sizes from N / 10.

    Raises:
        ValueError: fewer than two points, a smallest subset of fewer than two samples or of all, a reference of fewer
            than two samples, or sets of different widths.
    """
    count = len(features)
    least = round(smallest * count)
    if points < 2 or not 2 <= least < count:
        raise ValueError(f"no line goes through {points} subsets of {least} to {count} samples")
    fixed = FeatureMoments.of(reference)
    sizes = torch.linspace(least, count, points, dtype=torch.float64).round()
    subsets = [features[torch.randperm(count, generator=generator)[: int(size)]] for size in sizes]
    distances = [frechet_distance_of_moments(FeatureMoments.of(subset), fixed) for subset in subsets]
    inverse, found = 1 / sizes, torch.tensor(distances, dtype=torch.float64)
    centred = inverse - inverse.mean()
    slope = (centred * found).sum() / centred.square().sum()
    return float(found.mean() - slope * inverse.mean())


def _factor(covariance: Tensor) -> Tensor:
    """R with R R^T = C: Cholesky's, or the symmetric root where C is not of full rank; rounding below zero is zero."""
    factor, failed_at = torch.linalg.cholesky_ex(covariance)
    if not failed_at:
        return factor
    values, vectors = torch.linalg.eigh(covariance)
    return (vectors * values.clamp(min=0).sqrt()) @ vectors.T
