"""What unrollers share whose controls are put together from mechanisms (Neural Marionette, section 4.2.1)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import torch
from torch import Tensor, nn

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


class FrameControls(nn.Module):
    """c_t = [W z_t, branches_t]: a code for every frame, and further features beside it.

    How the code becomes z_1..z_T is the subclass's; the `query` mechanisms, summed, tell it what a frame is about. It
    makes `projection`, too, which is W.

    Raises:
        CompositionError: branches that leave no width to the codes.
    """

    carries: ClassVar[frozenset[str]] = frozenset({"queries", "memory"})
    projection: nn.Module

    def __init__(
        self,
        dimensions: Dimensions,
        embeddings: Embeddings,
        query: Mapping[str, Builder[QueryMechanism]],
        branches: Mapping[str, Builder[ControlBranch]],
    ) -> None:
        super().__init__()
        mechanisms = {name: build(dimensions, embeddings) for name, build in query.items()}
        built = {name: build(dimensions, embeddings) for name, build in branches.items()}
        parts: list[QueryMechanism | ControlBranch] = [*mechanisms.values(), *built.values()]
        self.reads = frozenset({"mask"}).union(*(part.reads for part in parts))
        self.keeps_time = any(part.keeps_time for part in parts)
        self.query = nn.ModuleDict(mechanisms)
        self.branches = nn.ModuleDict(built)
        self.width = dimensions.width
        self.code_width = self.width - sum(branch.width for branch in built.values())
        if self.code_width <= 0:
            raise CompositionError(
                f"the branches of {type(self).__name__} leave {self.code_width} of {self.width} features to its codes"
            )

    def projection_of_codes(self) -> nn.Module:
        """W, to the width that the branches leave."""
        return nn.Linear(self.width, self.code_width) if self.branches else nn.Identity()

    def over_frames(self, condition: Condition, code: Tensor) -> Tensor:
        """The sum of the mechanisms for every frame, (B, T, D), in the code's dtype."""
        total = sum(
            (mechanism(condition) for mechanism in self.query.values()), start=torch.zeros((), device=code.device)
        )
        return total.to(code).expand(*condition.mask.shape, self.width)

    def beside(self, unrolled: Tensor, code: Code, condition: Condition) -> Controls:
        """The controls from the frames' codes, (B, T, D)."""
        extra = [branch(condition) for branch in self.branches.values()]
        controls = torch.cat([self.projection(unrolled), *extra], dim=-1)
        return Controls(queries=controls, memory=controls, mask=condition.mask, latent=code.latent)
