"""Scheduled sampling for Transformers (Neural Marionette, supplement section 3, Fig. 2)."""

from __future__ import annotations

from typing import ClassVar

import torch

from motiongen.contracts import Controls, Decoder, MotionBatch, Prediction
from motiongen.generation.schedules import LinearRamp
from motiongen.options import Share


class ScheduledSampling:
    """Two passes: the first on the true past, the second on a past in which predicted frames replace true ones.

    Before `activate` it is teacher forcing. From there the ratio of predicted frames rises linearly, from 0 to 1 at
    `accomplish`; both are fractions of the run (the paper's epochs 250 and 750 of 1000).
    """

    needs_past: ClassVar[bool] = True

    def __init__(self, *, activate: Share, accomplish: Share) -> None:
        self.ratio = LinearRamp(activate, accomplish)

    def __call__(
        self, decoder: Decoder, controls: Controls, batch: MotionBatch, progress: float, generator: torch.Generator
    ) -> Prediction:
        past = batch.past
        first = decoder(controls, batch.condition, past)
        if progress < self.ratio.start:
            return Prediction(first)
        # P'_t stands in for P_t from t = 1 on; P_0 is given. Predicted frames enter as data, without gradient.
        predicted = torch.cat([past[:, :1], first[:, :-1].detach()], dim=1)
        is_predicted = torch.rand(past.shape[:2], generator=generator).to(past.device) < self.ratio(progress)
        mixed = torch.where(is_predicted.unsqueeze(-1), predicted, past)
        return Prediction(decoder(controls, batch.condition, mixed), first_pass=first)
