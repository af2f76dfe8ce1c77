"""ACTOR's encoder without distribution tokens (ACTOR, section 4.2 "Architecture design", Table 2 b)."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import nn

from motiongen.contracts import Condition, Dimensions, MotionBatch, Posterior
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.pooling import masked_mean
from motiongen.generation.positions import sinusoidal
from motiongen.generation.priors import standard_normal
from motiongen.options import PositiveInt, Share


class MeanPooling(nn.Module):
    """Motion to the distribution of the code: the mean of a Transformer encoder's outputs, then two linear layers.

    The action is not seen; the prior is N(0, I).
    """

    reads: ClassVar[frozenset[str]] = frozenset()

    def __init__(
        self,
        dimensions: Dimensions,
        embeddings: Embeddings,
        *,
        layers: PositiveInt,
        heads: PositiveInt,
        feedforward: PositiveInt,
        dropout: Share,
        activation: str = "gelu",
    ) -> None:
        super().__init__()
        self.width = dimensions.width
        self.pose_embedding = nn.Linear(dimensions.features, self.width)
        self.dropout = nn.Dropout(dropout)
        layer = nn.TransformerEncoderLayer(self.width, heads, feedforward, dropout, activation, batch_first=True)
        self.transformer = nn.TransformerEncoder(layer, layers, enable_nested_tensor=False)
        self.mean = nn.Linear(self.width, self.width)
        self.log_variance = nn.Linear(self.width, self.width)

    def posterior(self, batch: MotionBatch) -> Posterior:
        mask = batch.condition.mask
        poses = self.pose_embedding(batch.motion)  # (B, T, D)
        positions = sinusoidal(torch.arange(poses.shape[1], device=poses.device), self.width)
        encoded = self.transformer(self.dropout(poses + positions.to(poses)), src_key_padding_mask=~mask)
        pooled = masked_mean(encoded, mask)
        return Posterior(self.mean(pooled), self.log_variance(pooled))

    def prior(self, condition: Condition) -> Posterior:
        return standard_normal(condition, self.width)
