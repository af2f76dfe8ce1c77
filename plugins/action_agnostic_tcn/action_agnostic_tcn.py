"""UM-CVAE's action-agnostic encoder (section 3.1, Eq. 1)."""

from __future__ import annotations

from typing import ClassVar

from torch import nn

from motiongen.contracts import CompositionError, Condition, Dimensions, MotionBatch, Posterior
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.pooling import masked_mean
from motiongen.generation.priors import standard_normal
from motiongen.generation.temporal_convolution import MaskedInstanceNorm, TemporalConvolution, dilation_of
from motiongen.options import PositiveInt


class ActionAgnosticTCN(nn.Module):
    """Motion alone to the distribution of a code that knows little of the action.

    Temporal convolutions with an instance normalisation among them, the mean over time, then one linear layer each for
    mean and log-variance. The normalisation takes every channel's mean and deviation out, which weakens what the code
    tells of the action. Generation draws from N(0, I).

    Args:
        layers: temporal convolutions, with dilations 1, 2, 4, repeated.
        channels: of each.
        kernel: frames of each kernel.
        normalize_after: how many of the layers come before the normalisation; None leaves it out (paper, Table 3).

    Raises:
        CompositionError: no layer comes after the normalisation, so that the mean over time would always be zero.
    """

    reads: ClassVar[frozenset[str]] = frozenset()

    def __init__(
        self,
        dimensions: Dimensions,
        embeddings: Embeddings,
        *,
        layers: PositiveInt,
        channels: PositiveInt,
        kernel: PositiveInt,
        normalize_after: PositiveInt | None,
    ) -> None:
        super().__init__()
        if normalize_after is not None and normalize_after >= layers:
            raise CompositionError(
                f"action_agnostic_tcn: the mean over time of normalised features is zero, so a layer has to follow the "
                f"normalisation; set normalize_after ({normalize_after}) below layers ({layers})"
            )
        self.width = dimensions.width
        widths = [dimensions.features] + [channels] * layers
        stack: list[nn.Module] = [
            TemporalConvolution(widths[layer], channels, kernel=kernel, dilation=dilation_of(layer))
            for layer in range(layers)
        ]
        if normalize_after is not None:
            stack.insert(normalize_after, MaskedInstanceNorm())
        self.stack = nn.ModuleList(stack)
        self.mean = nn.Linear(channels, self.width)
        self.log_variance = nn.Linear(channels, self.width)

    def posterior(self, batch: MotionBatch) -> Posterior:
        mask = batch.condition.mask
        frames = batch.motion
        for layer in self.stack:
            frames = layer(frames, mask)
        pooled = masked_mean(frames, mask)
        return Posterior(self.mean(pooled), self.log_variance(pooled))

    def prior(self, condition: Condition) -> Posterior:
        return standard_normal(condition, self.width)
