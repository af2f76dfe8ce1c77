"""MARIONET's tag injection (Neural Marionette, section 4.2.1)."""

from __future__ import annotations

from typing import ClassVar

from torch import Tensor

from motiongen.contracts import Condition, Dimensions, QueryMechanism
from motiongen.generation.embeddings import Embeddings


class TagInjection(QueryMechanism):
    """The embedded current tag, added to every frame's query, so that the tag is not drowned by the context."""

    reads: ClassVar[frozenset[str]] = frozenset({"tags"})
    keeps_time: ClassVar[bool] = False

    def __init__(self, dimensions: Dimensions, embeddings: Embeddings) -> None:
        super().__init__()
        self.tag_embedding = embeddings.tags

    def forward(self, condition: Condition) -> Tensor:
        """(B, 1, D)"""
        return self.tag_embedding(condition.tags).unsqueeze(1)
