"""MARIONET's Motion Decoder (Neural Marionette, section 4.2.1)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import torch
from torch import Tensor, nn

from motiongen.contracts import Builder, Condition, Controls, Dimensions, LayerInput, MotionBatch
from motiongen.generation.attention import DecoderLayer
from motiongen.generation.bank import TaggedBank
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.incremental import IncrementalDecoder
from motiongen.generation.layer_input import LayerInputs
from motiongen.generation.positions import sinusoidal
from motiongen.options import PositiveInt, Share

DISPLACEMENT = 0.1
"""The size of the output layer's first weights where it gives displacements, beside where it gives poses."""


class AutoregressiveTransformer(nn.Module):
    """Causal Transformer decoder from the poses so far and the controls to the next pose.

    Query: embedded past poses with positional encoding; key and value: the controls' memory. The first past pose (begin
    of pose) is the last frame of the initial motion. What the `layer_input` mechanisms give is added to the input of
    every layer but the first.

    The output layer gives a pose plus `residual` times the pose before it. 0 is the paper's. With 1 it gives
    displacements (Martinez et al. 2017, section 3.2), which a short run learns far more precisely. They add up, so the
    training scheme has to show the decoder a past of its own making.

    Raises:
        CompositionError: `layer_input` for a single layer.
    """

    reads: ClassVar[frozenset[str]] = frozenset({"initial_motion"})
    uses: ClassVar[frozenset[str]] = frozenset({"memory"})
    autoregressive: ClassVar[bool] = True
    keeps_time: ClassVar[bool] = True

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
        residual: Share = 0.0,
        activation: str = "gelu",
    ) -> None:
        super().__init__()
        self.width = dimensions.width
        self.residual = residual
        self.pose_embedding = embeddings.pose
        self.layer_input = LayerInputs(dimensions, embeddings, layer_input, layers)
        layer = DecoderLayer(self.width, heads, feedforward, dropout, activation, batch_first=True)
        self.transformer = nn.TransformerDecoder(layer, layers)
        self.pose = nn.Linear(self.width, dimensions.features)
        # Begun with displacements of the size of poses, a short run never becomes precise.
        for parameter in self.pose.parameters():
            parameter.data *= 1 - residual * (1 - DISPLACEMENT)
        self.beginnings = TaggedBank(dimensions.tags, self.width)

    def forward(self, controls: Controls, condition: Condition, past: Tensor) -> Tensor:
        """Past (B, T, F) to the poses that follow each of its frames, (B, T, F)."""
        frames = torch.arange(past.shape[1], device=past.device)
        query = self.pose_embedding(past) + sinusoidal(frames, self.width).to(past)
        future = torch.ones(len(frames), len(frames), dtype=torch.bool, device=past.device).triu(1)
        masks: dict[str, Any] = {"tgt_mask": future, "tgt_is_causal": True, "memory_key_padding_mask": ~controls.mask}
        first, *others = self.transformer.layers
        decoded = first(query, controls.memory, **masks)
        for layer in others:
            decoded = layer(decoded + self.layer_input(controls), controls.memory, **masks)
        return self.residual * past + self.pose(decoded)

    def begin_of_pose(self, condition: Condition) -> Tensor:
        return self.pose_embedding(condition.initial_motion[:, -1])

    def conclude(self, batches: Iterable[MotionBatch]) -> None:
        with torch.no_grad():
            filed = [(batch.condition.tags, self.begin_of_pose(batch.condition)) for batch in batches]
        tags, embeddings = zip(*filed, strict=True)
        self.beginnings.fill(torch.cat(tags), torch.cat(embeddings))

    def generate(self, controls: Controls, condition: Condition) -> Tensor:
        return self.generate_from(self.begin_of_pose(condition), controls, condition)

    def generate_from(self, begin_of_pose: Tensor, controls: Controls, condition: Condition) -> Tensor:
        frames = condition.mask.shape[1]
        layers = IncrementalDecoder(self.transformer.layers, controls.memory, controls.mask, frames)
        pose, embedded = condition.initial_motion[:, -1], begin_of_pose
        positions = sinusoidal(torch.arange(frames, device=pose.device), self.width).to(pose)
        added = self.layer_input(controls).expand(-1, frames, -1)
        motion = []
        for frame in range(frames):
            decoded = layers.step(frame, embedded + positions[frame], added[:, frame])
            pose = self.residual * pose + self.pose(decoded)
            embedded = self.pose_embedding(pose)
            motion.append(pose)
        return torch.stack(motion, dim=1)
