"""The code at every frame: MARIONET without Time Unrolling (Neural Marionette, section 5.1.4)."""

from __future__ import annotations

from collections.abc import Mapping

from motiongen.contracts import Builder, Code, Condition, ControlBranch, Controls, Dimensions, QueryMechanism
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.frame_controls import FrameControls


class Repetition(FrameControls):
    """z_1 = ... = z_T = z, plus the sum of the `query` mechanisms; the `branches` contribute further features.

    Raises:
        CompositionError: branches that leave no width to the codes.
    """

    def __init__(
        self,
        dimensions: Dimensions,
        embeddings: Embeddings,
        *,
        query: Mapping[str, Builder[QueryMechanism]],
        branches: Mapping[str, Builder[ControlBranch]],
    ) -> None:
        super().__init__(dimensions, embeddings, query, branches)
        self.projection = self.projection_of_codes()

    def forward(self, code: Code, condition: Condition) -> Controls:
        repeated = code.modulated.unsqueeze(1) + self.over_frames(condition, code.modulated)
        return self.beside(repeated, code, condition)
