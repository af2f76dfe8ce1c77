"""A fully connected decoder (ACTOR, section 4.2 "Architecture design", Table 2 "Fully connected")."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor, nn

from motiongen.contracts import Condition, Controls, Dimensions
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.perceptron import perceptron
from motiongen.generation.pooling import masked_mean
from motiongen.options import PositiveInt, Share


class FullyConnectedDecoder(nn.Module):
    """The same layers for every frame, from its query beside the mean of the memory to its pose."""

    reads: ClassVar[frozenset[str]] = frozenset()
    uses: ClassVar[frozenset[str]] = frozenset({"queries", "memory"})
    autoregressive: ClassVar[bool] = False
    keeps_time: ClassVar[bool] = False

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
        self.layers = perceptron(2 * dimensions.width, hidden, layers, dropout)
        self.pose = nn.Linear(hidden, dimensions.features)

    def forward(self, controls: Controls, condition: Condition, past: Tensor) -> Tensor:
        """The motion (B, T, F); `past` is not read."""
        return self.generate(controls, condition)

    def generate(self, controls: Controls, condition: Condition) -> Tensor:
        memory = masked_mean(controls.memory, controls.mask).unsqueeze(1)  # (B, 1, D)
        return self.pose(self.layers(torch.cat([controls.queries, memory.expand_as(controls.queries)], dim=-1)))
