"""MARIONET's reverse positional encoding (Neural Marionette, section 4.2.1)."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor

from motiongen.contracts import Condition, Dimensions, QueryMechanism
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.positions import sinusoidal


class ReversePositionalEncoding(QueryMechanism):
    """Positions T, T-1, ..., 1: every frame knows how many frames are left, so the action ends in time."""

    reads: ClassVar[frozenset[str]] = frozenset({"mask"})

    def __init__(self, dimensions: Dimensions, embeddings: Embeddings) -> None:
        super().__init__()
        self.width = dimensions.width

    def forward(self, condition: Condition) -> Tensor:
        """(B, T, D)"""
        frames = torch.arange(condition.mask.shape[1], device=condition.mask.device)
        left = (condition.lengths.unsqueeze(1) - frames).clamp(min=0)  # (B, T)
        return sinusoidal(left, self.width)
