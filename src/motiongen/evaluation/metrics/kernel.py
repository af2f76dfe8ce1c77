"""The kernel distance between two sets of recognizer features."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.evaluation.metrics.pairwise import require_sets, row_blocks


def kernel_distance(first: Tensor, second: Tensor) -> float:
    """Kernel Inception Distance (KID) between two sets of features x (N, E) and y (M, E).

    The unbiased estimate of the squared maximum mean discrepancy with the cubic kernel k(a, b) = (a.b / E + 1)^3: the
    mean of k over pairs of different x, plus that over pairs of different y, minus twice the mean over pairs of x and
    y. Unlike FID its expectation does not depend on N and M, so values of different counts compare. Unit: that of the
    kernel, which depends on the scale of the features. Range about 0 to infinity, below 0 by chance where the sets are
    alike; lower is better. Over the whole sets, not the mean over subsets of the original's code. Source: Binkowski et
    al. 2018, section 4.

    Raises:
        ValueError: a set of fewer than two samples, or of another width than the other.
    """
    require_sets("KID", first, second, least=2)
    first, second = first.double(), second.double()
    across = _kernel_sum(first, second) / (len(first) * len(second))
    return float(_mean_of_different(first) + _mean_of_different(second) - 2 * across)


def _mean_of_different(features: Tensor) -> Tensor:
    """The mean of the kernel over the pairs of a row with another."""
    own = _kernel(features.square().sum(dim=1), features.shape[1]).sum()
    return (_kernel_sum(features, features) - own) / (len(features) * (len(features) - 1))


def _kernel_sum(first: Tensor, second: Tensor) -> Tensor:
    sums = [_kernel(rows @ second.T, first.shape[1]).sum() for rows in row_blocks(first, second)]
    return torch.stack(sums).sum()


def _kernel(products: Tensor, width: int) -> Tensor:
    return (products / width + 1) ** 3
