"""The code at every frame: MARIONET without Time Unrolling (Neural Marionette, section 5.1.4)."""

from __future__ import annotations

from typing import ClassVar

from torch import nn

from motiongen.contracts import Code, Condition, Controls, Dimensions
from motiongen.generation.embeddings import Embeddings


class Repetition(nn.Module):
    """c_1 = ... = c_T = z', as queries and as memory."""

    reads: ClassVar[frozenset[str]] = frozenset({"mask"})
    carries: ClassVar[frozenset[str]] = frozenset({"queries", "memory"})
    keeps_time: ClassVar[bool] = False

    def __init__(self, dimensions: Dimensions, embeddings: Embeddings) -> None:
        super().__init__()

    def forward(self, code: Code, condition: Condition) -> Controls:
        controls = code.modulated.unsqueeze(1).expand(-1, condition.mask.shape[1], -1)
        return Controls(queries=controls, memory=controls, mask=condition.mask, latent=code.latent)
