"""Scheduled sampling for Transformers (Neural Marionette, supplement section 3, Fig. 2)."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor

from motiongen.contracts import Controls, Decoder, MotionBatch, Prediction
from motiongen.generation.schedules import LinearRamp
from motiongen.options import PositiveInt, Share


class ScheduledSampling:
    """Two passes: the first on the true past, the second on a past in which predicted frames replace true ones.

    Before `activate` it is teacher forcing. From there the ratio of predicted frames rises linearly, from 0 to 1 at
    `accomplish`; both are fractions of the run (the paper's epochs 250 and 750 of 1000). The second pass can be
    repeated: with `feedbacks` 2 or more, each repetition's past holds what the one before predicted, so that a short
    run, too, meets errors that have grown over several frames. Only the first and the last pass are trained on; the
    paper's number of feedbacks is 1.
    """

    needs_past: ClassVar[bool] = True

    def __init__(self, *, activate: Share, accomplish: Share, feedbacks: PositiveInt = 1) -> None:
        self.ratio = LinearRamp(activate, accomplish)
        self.feedbacks = feedbacks

    def __call__(
        self, decoder: Decoder, controls: Controls, batch: MotionBatch, progress: float, generator: torch.Generator
    ) -> Prediction:
        past = batch.past
        first = decoder(controls, batch.condition, past)
        if progress < self.ratio.start:
            return Prediction(first)
        chosen = torch.rand(past.shape[:2], generator=generator).to(past.device) < self.ratio(progress)
        mixed = _mixed(past, first, chosen)
        for _ in range(self.feedbacks - 1):
            with torch.no_grad():
                mixed = _mixed(past, decoder(controls, batch.condition, mixed), chosen)
        return Prediction(decoder(controls, batch.condition, mixed), first_pass=first)


def _mixed(past: Tensor, predicted: Tensor, chosen: Tensor) -> Tensor:
    """P_mix (B, T, F): the past, with predicted frames, as data without gradient, where `chosen` (B, T) is True."""
    # P'_t stands in for P_t from t = 1 on; P_0 is given.
    shifted = torch.cat([past[:, :1], predicted[:, :-1].detach()], dim=1)
    return torch.where(chosen.unsqueeze(-1), shifted, past)
