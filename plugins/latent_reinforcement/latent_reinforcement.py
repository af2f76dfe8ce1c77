"""UM-CVAE's latent reinforcement (section 3.1 "Temporal decoder", section 4.3)."""

from __future__ import annotations

from torch import Tensor

from motiongen.contracts import Controls, Dimensions, LayerInput
from motiongen.generation.embeddings import Embeddings


class LatentReinforcement(LayerInput):
    """The unmodulated z, so that a strong condition cannot make the decoder forget it."""

    def __init__(self, dimensions: Dimensions, embeddings: Embeddings) -> None:
        super().__init__()

    def forward(self, controls: Controls) -> Tensor:
        """(B, 1, D)"""
        return controls.latent.unsqueeze(1)
