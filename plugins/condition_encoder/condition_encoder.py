"""MARIONET's Condition Encoder (Neural Marionette, section 4.2.1)."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import nn

from motiongen.contracts import Condition, Dimensions, MotionBatch, Posterior
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.positions import sinusoidal
from motiongen.options import PositiveInt, Share


class ConditionEncoder(nn.Module):
    """Context to the distribution of the action-level code.

    [embedded initial poses, embedded current tag, embedded next tag] pass a Transformer encoder; the output at the
    current tag's token is pooled, and two linear layers give mean and log-variance. It never sees the motion that it
    stands for, so posterior and prior are one distribution (section 4.2.3).

    Without `looks_ahead` the next tag is the zero vector, as where it is unknown (section 5.2.4, "w/o next tag").
    """

    reads: ClassVar[frozenset[str]] = frozenset({"tags", "next_tags", "initial_motion"})

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
        looks_ahead: bool = True,
    ) -> None:
        super().__init__()
        self.looks_ahead = looks_ahead
        width = dimensions.width
        self.pose_embedding = embeddings.pose
        self.tag_embedding = embeddings.tags
        layer = nn.TransformerEncoderLayer(width, heads, feedforward, dropout, activation, batch_first=True)
        self.transformer = nn.TransformerEncoder(layer, layers, enable_nested_tensor=False)
        self.mean = nn.Linear(width, width)
        self.log_variance = nn.Linear(width, width)

    def prior(self, condition: Condition) -> Posterior:
        poses = self.pose_embedding(condition.initial_motion)  # (B, K, D)
        tag = self.tag_embedding(condition.tags).unsqueeze(1)  # (B, 1, D)
        next_tag = self.tag_embedding(self.looks_ahead * condition.next_tags).unsqueeze(1)  # (B, 1, D)
        tokens = torch.cat([poses, tag, next_tag], dim=1)
        # The paper names no positional encoding here; without one the two tags could not be told apart.
        positions = torch.arange(tokens.shape[1], device=tokens.device)
        encoded = self.transformer(tokens + sinusoidal(positions, tokens.shape[2]).to(tokens))
        pooled = encoded[:, -2]
        return Posterior(self.mean(pooled), self.log_variance(pooled))

    def posterior(self, batch: MotionBatch) -> Posterior:
        return self.prior(batch.condition)
