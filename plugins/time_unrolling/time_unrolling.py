"""MARIONET's Time Unrolling module (Neural Marionette, section 4.2.1)."""

from __future__ import annotations

from collections.abc import Mapping

from torch import nn

from motiongen.contracts import (
    Builder,
    Code,
    CompositionError,
    Condition,
    ControlBranch,
    Controls,
    Dimensions,
    QueryMechanism,
)
from motiongen.generation.attention import DecoderLayer
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.frame_controls import FrameControls
from motiongen.options import PositiveInt, Share


class TimeUnrolling(FrameControls):
    """Unrolls z into frame-level controls c_1..c_T with a Transformer decoder.

    Key and value are z, the query is the sum of the `query` mechanisms. The `branches` contribute further features to
    every frame's control; the unrolled codes are projected to the width that they leave.

    Raises:
        CompositionError: no query mechanism, or branches that leave no width to the unrolled codes.
    """

    def __init__(
        self,
        dimensions: Dimensions,
        embeddings: Embeddings,
        *,
        query: Mapping[str, Builder[QueryMechanism]],
        branches: Mapping[str, Builder[ControlBranch]],
        layers: PositiveInt,
        heads: PositiveInt,
        feedforward: PositiveInt,
        dropout: Share,
        activation: str = "relu",
    ) -> None:
        if not query:
            raise CompositionError("time_unrolling needs at least one mechanism in generator/unroller/query")
        super().__init__(dimensions, embeddings, query, branches)
        layer = DecoderLayer(self.width, heads, feedforward, dropout, activation, batch_first=True)
        self.transformer = nn.TransformerDecoder(layer, layers)
        self.projection = self.projection_of_codes()

    def forward(self, code: Code, condition: Condition) -> Controls:
        query = self.over_frames(condition, code.modulated)
        unrolled = self.transformer(query, code.modulated.unsqueeze(1), tgt_key_padding_mask=~condition.mask)
        return self.beside(unrolled, code, condition)
