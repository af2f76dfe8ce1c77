"""ACTOR's bias token (ACTOR, section 3.1 "Decoder")."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor, nn

from motiongen.contracts import Condition, Conditioning, Dimensions
from motiongen.generation.embeddings import Embeddings


class BiasToken(Conditioning):
    """z' = z + b_a: a learnable vector per action shifts the code to the action's region.

    A motion with several tags gets the sum of their vectors (the paper has one action for each motion).
    """

    reads: ClassVar[frozenset[str]] = frozenset({"tags"})

    def __init__(self, dimensions: Dimensions, embeddings: Embeddings) -> None:
        super().__init__()
        self.biases = nn.Parameter(torch.randn(dimensions.tags, dimensions.width))

    def forward(self, latent: Tensor, condition: Condition, generator: torch.Generator) -> Tensor:
        return latent + condition.tags @ self.biases
