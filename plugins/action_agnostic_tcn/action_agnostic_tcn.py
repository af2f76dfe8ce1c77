"""UM-CVAE's action-agnostic encoder (section 3.1, Eq. 1)."""

from __future__ import annotations

from typing import ClassVar

from torch import nn

from motiongen.contracts import CompositionError, Condition, Dimensions, MotionBatch, Posterior
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.pooling import segment_means
from motiongen.generation.priors import standard_normal
from motiongen.generation.temporal_convolution import MaskedInstanceNorm, TemporalConvolution, dilation_of
from motiongen.options import PositiveInt


class ActionAgnosticTCN(nn.Module):
    """Motion alone to the distribution of a code that knows little of the action.

    Temporal convolutions with an instance normalisation among them, the means of equal parts of the motion, then one
    linear layer each for mean and log-variance. The normalisation takes every channel's mean and deviation out, which
    weakens what the code tells of the action. Generation draws from N(0, I).

    Args:
        layers: temporal convolutions, with dilations 1, 2, 4, repeated.
        channels: of each.
        kernel: frames of each kernel.
        normalize_after: how many of the layers come before the normalisation; None leaves it out (paper, Table 3).
        segments: parts of the motion whose means are kept. With one, what the code tells is the same wherever in a
            cycle a walk begins; a decoder can then only give the mean of all phases, in which legs stand still.

    Raises:
        CompositionError: no layer comes after the normalisation, so that the means over the motion would be zero.
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
        segments: PositiveInt,
    ) -> None:
        super().__init__()
        if normalize_after is not None and normalize_after >= layers:
            raise CompositionError(
                f"action_agnostic_tcn: the mean over a motion of normalised features is zero, so a layer has to follow "
                f"the normalisation; set normalize_after ({normalize_after}) below layers ({layers})"
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
        self.segments = segments
        self.mean = nn.Linear(segments * channels, self.width)
        self.log_variance = nn.Linear(segments * channels, self.width)

    def posterior(self, batch: MotionBatch) -> Posterior:
        mask = batch.condition.mask
        frames = batch.motion
        for layer in self.stack:
            frames = layer(frames, mask)
        pooled = segment_means(frames, mask, self.segments)
        return Posterior(self.mean(pooled), self.log_variance(pooled))

    def prior(self, condition: Condition) -> Posterior:
        return standard_normal(condition, self.width)
