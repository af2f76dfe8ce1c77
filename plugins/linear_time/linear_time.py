"""UM-CVAE's expansion of the code in time (section 3.1 "Temporal decoder")."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import nn

from motiongen.contracts import Code, Condition, Controls, Dimensions
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.positions import sinusoidal


class LinearTime(nn.Module):
    """z' to z'_1 .. z'_T: a linear layer on the code and the encoding of each frame's number."""

    reads: ClassVar[frozenset[str]] = frozenset({"mask"})
    carries: ClassVar[frozenset[str]] = frozenset({"queries", "memory"})
    keeps_time: ClassVar[bool] = True

    def __init__(self, dimensions: Dimensions, embeddings: Embeddings) -> None:
        super().__init__()
        self.width = dimensions.width
        self.projection = nn.Linear(2 * self.width, self.width)

    def forward(self, code: Code, condition: Condition) -> Controls:
        batch, frames = condition.mask.shape
        time = sinusoidal(torch.arange(frames, device=condition.mask.device), self.width).to(code.modulated)
        repeated = code.modulated.unsqueeze(1).expand(-1, frames, -1)
        unrolled = self.projection(torch.cat([repeated, time.expand(batch, -1, -1)], dim=-1))
        return Controls(queries=unrolled, memory=unrolled, mask=condition.mask, latent=code.latent)
