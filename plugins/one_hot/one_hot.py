"""The label concatenated to the code (ACTOR, section 4.2 "Architecture design", Table 2 c)."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor, nn

from motiongen.contracts import Condition, Conditioning, Dimensions
from motiongen.generation.embeddings import Embeddings


class OneHot(Conditioning):
    """z' = W [z, a] + b: the multi-hot label behind the code, projected back to the code's width."""

    reads: ClassVar[frozenset[str]] = frozenset({"tags"})

    def __init__(self, dimensions: Dimensions, embeddings: Embeddings) -> None:
        super().__init__()
        self.projection = nn.Linear(dimensions.width + dimensions.tags, dimensions.width)

    def forward(self, latent: Tensor, condition: Condition, generator: torch.Generator) -> Tensor:
        return self.projection(torch.cat([latent, condition.tags], dim=-1))
