"""What a decoder adds to the inputs of its layers."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor, nn

from motiongen.contracts import Builder, CompositionError, Controls, Dimensions, LayerInput
from motiongen.generation.embeddings import Embeddings
from motiongen.options import PositiveInt


class LayerInputs(nn.Module):
    """The sum of a decoder's `layer_input` mechanisms; zero without any.

    Args:
        mechanisms: name -> builder.
        layers: of the decoder; the first one gets nothing added.

    Raises:
        CompositionError: mechanisms for a single layer, where they would have no effect.
    """

    def __init__(
        self,
        dimensions: Dimensions,
        embeddings: Embeddings,
        mechanisms: Mapping[str, Builder[LayerInput]],
        layers: PositiveInt,
    ) -> None:
        super().__init__()
        if mechanisms and layers < 2:
            raise CompositionError(
                f"{', '.join(mechanisms)} would have no effect: the first of a decoder's layers gets nothing added, "
                f"and this one has {layers}; set generator.decoder.layers=2 or more"
            )
        self.mechanisms = nn.ModuleDict({name: build(dimensions, embeddings) for name, build in mechanisms.items()})

    def forward(self, controls: Controls) -> Tensor:
        """(B, T or 1, D)"""
        nothing = torch.zeros_like(controls.latent).unsqueeze(1)
        return sum((mechanism(controls) for mechanism in self.mechanisms.values()), start=nothing)
