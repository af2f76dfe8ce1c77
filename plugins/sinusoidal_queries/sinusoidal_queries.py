"""ACTOR's time queries (ACTOR, section 3.1 "Decoder")."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import nn

from motiongen.contracts import Code, Condition, Controls, Dimensions
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.positions import sinusoidal


class SinusoidalQueries(nn.Module):
    """T sinusoidal encodings as queries and the single code z' as memory; nothing is learned here."""

    reads: ClassVar[frozenset[str]] = frozenset({"mask"})
    carries: ClassVar[frozenset[str]] = frozenset({"memory"})
    keeps_time: ClassVar[bool] = True

    def __init__(self, dimensions: Dimensions, embeddings: Embeddings) -> None:
        super().__init__()
        self.width = dimensions.width

    def forward(self, code: Code, condition: Condition) -> Controls:
        batch, frames = condition.mask.shape
        memory = code.modulated.unsqueeze(1)  # (B, 1, D)
        queries = sinusoidal(torch.arange(frames, device=memory.device), self.width).to(memory)
        return Controls(
            queries=queries.expand(batch, -1, -1),
            memory=memory,
            mask=condition.mask.new_ones(batch, 1),
            latent=code.latent,
        )
