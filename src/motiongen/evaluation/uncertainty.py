"""How far a figure may be from what other test clips would have given."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class Interval:
    """A value and the ends of its 95% interval. NaN where nothing could be measured."""

    value: float
    low: float
    high: float


def bootstrap(values: Tensor, takes: Tensor, draws: int, generator: torch.Generator) -> Interval:
    """The mean over clips with the 95% percentile interval of the cluster bootstrap.

    Windows of one take are alike, so that whole takes are drawn with replacement, as many as there are. Clips whose
    value is NaN are left out. Source: Efron and Tibshirani 1993, chapters 8 and 13.

    Args:
        values: (N,) one a clip.
        takes: (N,) which take each clip was cut from, numbered from 0.
        draws: resampled sets.
        generator: of the draws.
    """
    measured = values.isfinite()
    count = int(takes.max()) + 1
    sums = torch.zeros(count, dtype=torch.float64).index_add(0, takes, values.double().nan_to_num(0.0))
    counts = torch.zeros(count, dtype=torch.float64).index_add(0, takes, measured.double())
    drawn = torch.randint(count, (draws, count), generator=generator)
    means = sums[drawn].sum(dim=1) / counts[drawn].sum(dim=1)
    means = means[means.isfinite()]
    if not len(means):
        return Interval(math.nan, math.nan, math.nan)
    low, high = torch.quantile(means, torch.tensor([0.025, 0.975], dtype=torch.float64)).tolist()
    return Interval(float(sums.sum() / counts.sum()), low, high)


def jackknife(statistic: Callable[[Tensor], float], takes: Tensor, groups: int) -> Interval:
    """A statistic of all clips with the 95% interval of the delete-a-group jackknife.

    For distances between distributions, which a bootstrap biases: clips that are drawn twice make a set look narrower.
    Here every set that is compared has the same size and no clip twice. Takes go to the groups in turn; the interval is
    value +- 1.96 sqrt((G - 1) / G sum (value_g - mean)^2). Source: Efron and Tibshirani 1993, chapter 11.

    Args:
        statistic: of the clips that a mask (N,) keeps.
        takes: (N,) which take each clip was cut from, numbered from 0.
        groups: G, fewer where there are fewer takes.
    """
    value = statistic(torch.ones(len(takes), dtype=torch.bool))
    groups = min(groups, int(takes.max()) + 1)
    left_out = torch.tensor([statistic(takes % groups != group) for group in range(groups)], dtype=torch.float64)
    if groups < 2 or not left_out.isfinite().all():
        return Interval(value, math.nan, math.nan)
    spread = (left_out - left_out.mean()).square().sum() * (groups - 1) / groups
    half = 1.96 * float(spread.sqrt())
    return Interval(value, value - half, value + half)
