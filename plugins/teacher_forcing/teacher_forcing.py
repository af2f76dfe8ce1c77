"""Teacher forcing (Williams and Zipser 1989)."""

from __future__ import annotations

from typing import ClassVar

import torch

from motiongen.contracts import Controls, Decoder, MotionBatch, Prediction


class TeacherForcing:
    """The decoder predicts every frame from the true frames before it."""

    needs_past: ClassVar[bool] = True

    def __call__(
        self, decoder: Decoder, controls: Controls, batch: MotionBatch, progress: float, generator: torch.Generator
    ) -> Prediction:
        return Prediction(decoder(controls, batch.condition, batch.past))
