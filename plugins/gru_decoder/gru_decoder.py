"""UM-CVAE's recurrent decoder (section 3.1 "Temporal decoder")."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from torch import Tensor, nn

from motiongen.contracts import Builder, Condition, Controls, Dimensions, LayerInput
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.layer_input import LayerInputs
from motiongen.options import PositiveInt, Share


class GRUDecoder(nn.Module):
    """GRU layers over the controls' queries, then a linear layer to the pose.

    What the `layer_input` mechanisms give is added to the input of every layer but the first. The layers run forward,
    so padding, which comes last, reaches no valid frame.

    Args:
        residual: this share of what a layer got is added to what it gives. 0 is the paper's. With 1 the controls reach
            the pose along a short way, and short runs learn the cycle of a walk, whose phase is in the controls.

    Raises:
        CompositionError: `layer_input` for a single layer.
    """

    reads: ClassVar[frozenset[str]] = frozenset()
    uses: ClassVar[frozenset[str]] = frozenset({"queries"})
    autoregressive: ClassVar[bool] = False
    keeps_time: ClassVar[bool] = True

    def __init__(
        self,
        dimensions: Dimensions,
        embeddings: Embeddings,
        *,
        layer_input: Mapping[str, Builder[LayerInput]],
        layers: PositiveInt,
        residual: Share = 0.0,
    ) -> None:
        super().__init__()
        width = dimensions.width
        self.residual = residual
        self.layer_input = LayerInputs(dimensions, embeddings, layer_input, layers)
        self.layers = nn.ModuleList(nn.GRU(width, width, batch_first=True) for _ in range(layers))
        self.pose = nn.Linear(width, dimensions.features)

    def forward(self, controls: Controls, condition: Condition, past: Tensor) -> Tensor:
        return self.generate(controls, condition)

    def generate(self, controls: Controls, condition: Condition) -> Tensor:
        first, *others = self.layers
        states = self.residual * controls.queries + first(controls.queries)[0]
        for layer in others:
            states = self.residual * states + layer(states + self.layer_input(controls))[0]
        return self.pose(states)
