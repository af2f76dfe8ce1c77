"""MARIONET's trajectory branch (Neural Marionette, section 4.2.1, supplement Table 2)."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor, nn

from motiongen.contracts import Condition, ControlBranch, Dimensions
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.positions import sinusoidal
from motiongen.options import PositiveInt, Share


class TrajectoryBranch(ControlBranch):
    """The path on the floor to frame-level controls: a linear layer, then a Transformer encoder over the frames."""

    reads: ClassVar[frozenset[str]] = frozenset({"trajectory", "mask"})

    def __init__(
        self,
        dimensions: Dimensions,
        embeddings: Embeddings,
        *,
        width: PositiveInt,
        layers: PositiveInt,
        heads: PositiveInt,
        feedforward: PositiveInt,
        dropout: Share,
        activation: str = "relu",
    ) -> None:
        super().__init__()
        self.width = width
        self.embedding = nn.Sequential(nn.Linear(2, width), nn.ReLU())
        layer = nn.TransformerEncoderLayer(width, heads, feedforward, dropout, activation, batch_first=True)
        self.transformer = nn.TransformerEncoder(layer, layers, enable_nested_tensor=False)

    def forward(self, condition: Condition) -> Tensor:
        """(B, T, width)"""
        points = self.embedding(condition.trajectory)
        # The paper names no positional encoding here; without one the branch could not tell the order of the points.
        positions = torch.arange(points.shape[1], device=points.device)
        return self.transformer(
            points + sinusoidal(positions, self.width).to(points), src_key_padding_mask=~condition.mask
        )
