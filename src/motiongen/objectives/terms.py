"""Loss terms over padded batches."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.contracts import Posterior


def squared_error(predicted: Tensor, target: Tensor, mask: Tensor) -> Tensor:
    """Mean squared error of (B, T, Q) over each motion's valid frames, averaged over motions (Eq. 1b-d, first sum).

    A motion without valid frames counts as zero error.
    """
    # Padded poses are zeros, which are no rotations: their joint positions are not numbers, so they are cut out here.
    error = torch.where(mask.unsqueeze(-1), predicted - target, 0.0)
    return mean_over_frames(error.square().mean(dim=-1), mask)


def mean_over_frames(values: Tensor, mask: Tensor) -> Tensor:
    """Mean of (B, T) over each motion's valid frames, averaged over motions; 0 for a motion without any."""
    return (torch.where(mask, values, 0.0).sum(dim=1) / mask.sum(dim=1).clamp(min=1)).mean()


def velocity_error(predicted: Tensor, target: Tensor, mask: Tensor) -> Tensor:
    """Squared error of the frame differences, t = 2..T (Eq. 1b-d, second sum); zero for motions of one frame."""
    pairs = mask[:, 1:] & mask[:, :-1]
    return squared_error(predicted.diff(dim=1), target.diff(dim=1), pairs)


def kl_divergence(one: Posterior, other: Posterior) -> Tensor:
    """KL(one || other) of diagonal Gaussians (..., D), summed over D: (...)."""
    spread = one.log_variance - other.log_variance
    shift = (one.mean - other.mean).square() * (-other.log_variance).exp()
    return 0.5 * (shift + spread.exp() - 1 - spread).sum(dim=-1)


def kl_to_standard_normal(posterior: Posterior) -> Tensor:
    """KL(N(mean, variance) || N(0, I)), summed over the code, averaged over the batch."""
    mean, log_variance = posterior.mean, posterior.log_variance
    return 0.5 * (mean.square() + log_variance.exp() - 1 - log_variance).sum(dim=-1).mean()
