"""ACTOR's encoder (ACTOR, section 3.1 "Encoder")."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import nn

from motiongen.contracts import Condition, Dimensions, MotionBatch, Posterior
from motiongen.generation.attention import first_outputs
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.positions import sinusoidal
from motiongen.generation.priors import standard_normal
from motiongen.options import PositiveInt, Share


class TokenPooling(nn.Module):
    """Motion and action to the distribution of the code, pooled over time by two learnable tokens.

    The action's two tokens are put before the linearly embedded poses, sinusoidal positions are added, and a
    Transformer encoder follows; its outputs at the two tokens are mean and log-variance as they are. The prior is
    N(0, I).

    A motion with several tags gets the sum of their tokens (the paper has one action for each motion).

    Args:
        norm_first: layers normalise what they get, not what they give. False is the paper's; short runs learn several
            times faster with True.
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
        norm_first: bool = False,
    ) -> None:
        super().__init__()
        self.width = dimensions.width
        # Linear, where the embedding that stages share has a ReLU (MARIONET's).
        self.pose_embedding = nn.Linear(dimensions.features, self.width)
        self.mean_tokens = nn.Parameter(torch.randn(dimensions.tags, self.width))
        self.log_variance_tokens = nn.Parameter(torch.randn(dimensions.tags, self.width))
        self.dropout = nn.Dropout(dropout)
        layer = nn.TransformerEncoderLayer(
            self.width, heads, feedforward, dropout, activation, batch_first=True, norm_first=norm_first
        )
        self.transformer = nn.TransformerEncoder(layer, layers, enable_nested_tensor=False)

    def posterior(self, batch: MotionBatch) -> Posterior:
        tags, mask = batch.condition.tags, batch.condition.mask
        tokens = torch.stack([tags @ self.mean_tokens, tags @ self.log_variance_tokens], dim=1)  # (B, 2, D)
        sequence = torch.cat([tokens, self.pose_embedding(batch.motion)], dim=1)  # (B, 2 + T, D)
        positions = sinusoidal(torch.arange(sequence.shape[1], device=sequence.device), self.width)
        valid = torch.cat([mask.new_ones(tokens.shape[:2]), mask], dim=1)
        encoded = self.dropout(sequence + positions.to(sequence))
        *layers, last = self.transformer.layers
        for layer in layers:
            encoded = layer(encoded, src_key_padding_mask=~valid)
        mean, log_variance = first_outputs(last, encoded, valid, 2).unbind(1)
        return Posterior(mean, log_variance)

    def prior(self, condition: Condition) -> Posterior:
        return standard_normal(condition, self.width)
