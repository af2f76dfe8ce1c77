"""A fully connected encoder (ACTOR, section 4.2 "Architecture design", Table 2 "Fully connected")."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import nn

from motiongen.contracts import Condition, Dimensions, MotionBatch, Posterior
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.perceptron import perceptron
from motiongen.generation.pooling import masked_mean
from motiongen.generation.positions import sinusoidal
from motiongen.generation.priors import standard_normal
from motiongen.options import PositiveInt, Share


class FullyConnectedEncoder(nn.Module):
    """Motion and action to the distribution of the code: the same layers for every frame, then their mean.

    Every frame's pose is embedded together with the tags, and its position is added, so that the mean over the frames
    still depends on their order. The prior is N(0, I).
    """

    reads: ClassVar[frozenset[str]] = frozenset()

    def __init__(
        self,
        dimensions: Dimensions,
        embeddings: Embeddings,
        *,
        layers: PositiveInt,
        hidden: PositiveInt,
        dropout: Share,
    ) -> None:
        super().__init__()
        self.width = dimensions.width
        self.embedding = nn.Linear(dimensions.features + dimensions.tags, self.width)
        self.layers = perceptron(self.width, hidden, layers, dropout)
        self.mean = nn.Linear(hidden, self.width)
        self.log_variance = nn.Linear(hidden, self.width)

    def posterior(self, batch: MotionBatch) -> Posterior:
        tags = batch.condition.tags.unsqueeze(1).expand(-1, batch.motion.shape[1], -1)  # (B, T, A)
        frames = self.embedding(torch.cat([batch.motion, tags], dim=-1))  # (B, T, D)
        positions = sinusoidal(torch.arange(frames.shape[1], device=frames.device), self.width)
        pooled = masked_mean(self.layers(frames + positions.to(frames)), batch.condition.mask)
        return Posterior(self.mean(pooled), self.log_variance(pooled))

    def prior(self, condition: Condition) -> Posterior:
        return standard_normal(condition, self.width)
