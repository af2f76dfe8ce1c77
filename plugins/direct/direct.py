"""Direct reconstruction (ACTOR, UM-CVAE)."""

from __future__ import annotations

from typing import ClassVar

import torch

from motiongen.contracts import Controls, Decoder, MotionBatch, Prediction


class Direct:
    """The decoder makes the motion from the controls alone; no past is shown."""

    needs_past: ClassVar[bool] = False

    def __call__(
        self, decoder: Decoder, controls: Controls, batch: MotionBatch, progress: float, generator: torch.Generator
    ) -> Prediction:
        return Prediction(decoder(controls, batch.condition, batch.past))
