"""ACTOR's decoder (ACTOR, section 3.1 "Decoder")."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from torch import Tensor, nn

from motiongen.contracts import Builder, Condition, Controls, Dimensions, LayerInput
from motiongen.generation.attention import DecoderLayer
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.layer_input import LayerInputs
from motiongen.options import PositiveInt, Share


class OneShotTransformer(nn.Module):
    """Transformer decoder from the controls to the whole motion at once.

    Query: the controls' queries; key and value: their memory. Frames attend to each other in both directions. What the
    `layer_input` mechanisms give is added to the input of every layer but the first.

    Args:
        norm_first: layers normalise what they get, not what they give. False is the paper's; short runs learn several
            times faster with True.

    Raises:
        CompositionError: `layer_input` for a single layer.
    """

    reads: ClassVar[frozenset[str]] = frozenset({"mask"})
    uses: ClassVar[frozenset[str]] = frozenset({"queries", "memory"})
    autoregressive: ClassVar[bool] = False
    keeps_time: ClassVar[bool] = False

    def __init__(
        self,
        dimensions: Dimensions,
        embeddings: Embeddings,
        *,
        layer_input: Mapping[str, Builder[LayerInput]],
        layers: PositiveInt,
        heads: PositiveInt,
        feedforward: PositiveInt,
        dropout: Share,
        activation: str = "gelu",
        norm_first: bool = False,
    ) -> None:
        super().__init__()
        width = dimensions.width
        self.layer_input = LayerInputs(dimensions, embeddings, layer_input, layers)
        self.dropout = nn.Dropout(dropout)
        layer = DecoderLayer(width, heads, feedforward, dropout, activation, batch_first=True, norm_first=norm_first)
        self.transformer = nn.TransformerDecoder(layer, layers)
        self.pose = nn.Linear(width, dimensions.features)

    def forward(self, controls: Controls, condition: Condition, past: Tensor) -> Tensor:
        """The motion (B, T, F); `past` is not read."""
        return self.generate(controls, condition)

    def generate(self, controls: Controls, condition: Condition) -> Tensor:
        masks: dict[str, Any] = {
            "tgt_key_padding_mask": ~condition.mask,
            "memory_key_padding_mask": ~controls.mask,
        }
        first, *others = self.transformer.layers
        decoded = first(self.dropout(controls.queries), controls.memory, **masks)
        for layer in others:
            decoded = layer(decoded + self.layer_input(controls), controls.memory, **masks)
        return self.pose(decoded)
