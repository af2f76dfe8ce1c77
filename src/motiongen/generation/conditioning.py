"""The empty filling of the conditioning slot."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor

from motiongen.contracts import Condition, Conditioning, Dimensions
from motiongen.generation.embeddings import Embeddings


class Unconditioned(Conditioning):
    """z' = z: the code reaches the unroller as the encoder made it."""

    reads: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, dimensions: Dimensions, embeddings: Embeddings) -> None:
        super().__init__()

    def forward(self, latent: Tensor, condition: Condition, generator: torch.Generator) -> Tensor:
        return latent
