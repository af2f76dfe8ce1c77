"""MARIONET's Time Unrolling module (Neural Marionette, section 4.2.1)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import torch
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
from motiongen.generation.embeddings import Embeddings
from motiongen.options import PositiveInt, Share


class TimeUnrolling(nn.Module):
    """Unrolls z into frame-level controls c_1..c_T with a Transformer decoder.

    Key and value are z, the query is the sum of the `query` mechanisms. The `branches` contribute further features to
    every frame's control; the unrolled codes are projected to the width that they leave.

    Raises:
        CompositionError: no query mechanism, or branches that leave no width to the unrolled codes.
    """

    carries: ClassVar[frozenset[str]] = frozenset({"queries", "memory"})

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
        super().__init__()
        if not query:
            raise CompositionError("time_unrolling needs at least one mechanism in generator/unroller/query")
        mechanisms = {name: build(dimensions, embeddings) for name, build in query.items()}
        built = {name: build(dimensions, embeddings) for name, build in branches.items()}
        parts: list[QueryMechanism | ControlBranch] = [*mechanisms.values(), *built.values()]
        self.reads = frozenset({"mask"}).union(*(part.reads for part in parts))
        self.keeps_time = any(part.keeps_time for part in parts)
        self.query = nn.ModuleDict(mechanisms)
        self.branches = nn.ModuleDict(built)
        width = dimensions.width
        remaining = width - sum(branch.width for branch in built.values())
        if remaining <= 0:
            raise CompositionError(f"the branches of time_unrolling leave {remaining} of {width} features to its codes")
        layer = nn.TransformerDecoderLayer(width, heads, feedforward, dropout, activation, batch_first=True)
        self.transformer = nn.TransformerDecoder(layer, layers)
        self.projection = nn.Linear(width, remaining) if self.branches else nn.Identity()

    def forward(self, code: Code, condition: Condition) -> Controls:
        batch, frames = condition.mask.shape
        query = sum(mechanism(condition) for mechanism in self.query.values())
        query = query.to(code.modulated).expand(batch, frames, -1)
        unrolled = self.transformer(query, code.modulated.unsqueeze(1), tgt_key_padding_mask=~condition.mask)
        extra = [branch(condition) for branch in self.branches.values()]
        controls = torch.cat([self.projection(unrolled), *extra], dim=-1)
        return Controls(queries=controls, memory=controls, mask=condition.mask, latent=code.latent)
