"""The empty filling of the conditioning slot."""

from __future__ import annotations

from typing import ClassVar

from torch import Tensor, nn

from motiongen.contracts import Condition, Dimensions
from motiongen.generation.embeddings import Embeddings


class Unconditioned(nn.Module):
    """z' = z: the code reaches the unroller as the encoder made it."""

    reads: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, dimensions: Dimensions, embeddings: Embeddings) -> None:
        super().__init__()

    def forward(self, code: Tensor, condition: Condition) -> Tensor:
        return code
