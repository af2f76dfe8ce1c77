"""Distances between, and spreads of, sets of recognizer features."""

from __future__ import annotations

import torch
from torch import Tensor


def frechet_distance(first: Tensor, second: Tensor) -> float:
    """Frechet Inception Distance between two sets of features (N, E) and (M, E).

    |mu_1 - mu_2|^2 + tr(C_1 + C_2 - 2 (C_1 C_2)^(1/2)), covariances with N - 1. Unit: squared feature units. Range 0 to
    infinity, lower is better. Biased upwards by about 1/N, so only values of equal N compare. Source: Heusel et al.
    2017, Eq. 6, as in Action2Motion and Neural Marionette (section 5.1.2).

    The trace of the root is the sum of the singular values of C_1^(1/2) C_2^(1/2): symmetric roots in float64 are exact
    also for fewer samples than features, where a root of the product C_1 C_2 is not.

    Raises:
        ValueError: a set of fewer than two samples, or of another width than the other.
    """
    if min(len(first), len(second)) < 2 or first.shape[1] != second.shape[1]:
        shapes = f"{tuple(first.shape)} and {tuple(second.shape)}"
        raise ValueError(f"FID compares two sets of at least 2 samples and of equal width, not {shapes}")
    first, second = first.double(), second.double()
    covariances = first.T.cov(), second.T.cov()
    cross = torch.linalg.svdvals(_root(covariances[0]) @ _root(covariances[1])).sum()
    spread = covariances[0].trace() + covariances[1].trace() - 2 * cross
    distance = (first.mean(dim=0) - second.mean(dim=0)).square().sum() + spread
    return max(float(distance), 0.0)


def diversity(features: Tensor, generator: torch.Generator, pairs: int = 200) -> float:
    """Mean distance between randomly paired clips (N, E) of any action.

    `pairs` pairs are drawn with replacement, as in the code of Action2Motion (Guo et al. 2020, section 5.1, S_d = 200).
    Neural Marionette (section 5.1.2) pairs the two halves of the set, which has the same expectation but for the pairs
    of a clip with itself. Unit: feature units. Range 0 to infinity; best near the value of real clips.

    Raises:
        ValueError: fewer than two clips.
    """
    if len(features) < 2:
        raise ValueError(f"diversity needs at least 2 clips, not {len(features)}")
    return float(_pair_distances(features.double(), generator, pairs).mean())


def multimodality(features: Tensor, tags: Tensor, generator: torch.Generator, pairs: int = 20) -> float:
    """Mean distance between randomly paired clips of the same action, then the mean over actions.

    features (N, E), multi-hot tags (N, A). `pairs` pairs an action are drawn with replacement (Action2Motion, section
    5.1, S_l = 20; Neural Marionette, section 5.1.2: "the variance of the features sharing the same action tag, averaged
    over action categories"). Actions with fewer than two clips are left out. Unit: feature units. Range 0 to infinity;
    best near the value of real clips. NaN if every action is left out.
    """
    clips = [features[column > 0].double() for column in tags.T]
    distances = [_pair_distances(group, generator, pairs).mean() for group in clips if len(group) >= 2]
    return float(torch.stack(distances).mean()) if distances else float("nan")


def _pair_distances(features: Tensor, generator: torch.Generator, pairs: int) -> Tensor:
    first, second = torch.randint(len(features), (2, pairs), generator=generator)
    return (features[first] - features[second]).norm(dim=1)


def _root(covariance: Tensor) -> Tensor:
    """The symmetric root of a positive semi-definite matrix; rounding below zero is zero."""
    values, vectors = torch.linalg.eigh(covariance)
    return (vectors * values.clamp(min=0).sqrt()) @ vectors.T
