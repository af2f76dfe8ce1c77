"""How much of the generated clips is realistic, and how much of the real clips is generated, by nearest neighbours."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor

from motiongen.evaluation.metrics.pairwise import distance_blocks, require_sets


class PrecisionRecall(NamedTuple):
    """Each 0 to 1, higher is better."""

    precision: float
    """The share of generated clips among the real ones: fidelity."""
    recall: float
    """The share of real clips among the generated ones: variety."""


class DensityCoverage(NamedTuple):
    """Higher is better."""

    density: float
    """0 to infinity, about 1 for two sets of one distribution: fidelity, weighed by how many real clips are near."""
    coverage: float
    """0 to 1: the share of real clips with a generated one near: variety."""


def precision_recall(real: Tensor, generated: Tensor, k: int = 3) -> PrecisionRecall:
    """Improved precision and recall of generated (M, E) against real (N, E) features.

    A set's manifold is the union of the closed balls around its samples, each reaching to the sample's k-th nearest
    neighbour in the set. Precision is the share of generated samples on the real manifold, recall the share of real
    ones on the generated manifold. No unit, range 0 to 1, higher is better; best near the values of one half of the
    real clips against the other. Both change with N and M, so only values of equal counts compare; a single real
    outlier's ball may be large and raise precision. Source: Kynkäänniemi et al. 2019, section 2, whose k is 3.

    Raises:
        ValueError: k below 1, a set of k or fewer samples, or of another width than the other.
    """
    _require(real, generated, k)
    precise = _balls_around(generated, real, _radii(real, k), torch.le) > 0
    recalled = _balls_around(real, generated, _radii(generated, k), torch.le) > 0
    return PrecisionRecall(float(precise.double().mean()), float(recalled.double().mean()))


def density_coverage(real: Tensor, generated: Tensor, k: int = 5) -> DensityCoverage:
    """Density and coverage of generated (M, E) against real (N, E) features.

    Around every real sample lies a ball that reaches to its k-th nearest real neighbour. Density is the mean over
    generated samples of the number of balls that hold it, over k; coverage is the share of balls that hold a generated
    sample. Only the real set makes balls, which outliers among generated clips cannot widen, and density does not take
    one large ball for many. The balls are open, as in the authors' code, so that a set of different samples against
    itself has density and coverage 1. No unit; range 0 to infinity and 0 to 1, higher is better. Coverage grows with M
    and k, so only values of equal counts compare. Source: Naeem et al. 2020, section 3, whose k is 5.

    Raises:
        ValueError: k below 1, a set of k or fewer samples, or of another width than the other.
    """
    _require(real, generated, k)
    radii = _radii(real, k)
    density = _balls_around(generated, real, radii, torch.lt).double().mean() / k
    nearest = torch.cat([block.amin(dim=1) for block in distance_blocks(real, generated, exact=True)])
    return DensityCoverage(float(density), float((nearest < radii).double().mean()))


def _require(real: Tensor, generated: Tensor, k: int) -> None:
    if k < 1:
        raise ValueError(f"there is no {k}-th nearest neighbour")
    require_sets(f"a metric of {k} nearest neighbours", real, generated, least=k + 1)


def _radii(features: Tensor, k: int) -> Tensor:
    """(N,) distance of every sample (N, E) to its k-th nearest neighbour in the set; it is its own zeroth."""
    blocks = distance_blocks(features, features, exact=True)
    return torch.cat([block.topk(k + 1, dim=1, largest=False).values[:, -1] for block in blocks])


def _balls_around(points: Tensor, centres: Tensor, radii: Tensor, within: Callable[[Tensor, Tensor], Tensor]) -> Tensor:
    """(N,) how many balls around centres (M, E) hold each of points (N, E); `within` compares distance and radius."""
    blocks = distance_blocks(points, centres, exact=True)
    return torch.cat([within(block, radii).sum(dim=1) for block in blocks])
