"""Scheduled sampling for Transformers (Neural Marionette, supplement section 3, Fig. 2)."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor

from motiongen.contracts import Controls, Decoder, MotionBatch, Prediction
from motiongen.generation.schedules import LinearRamp
from motiongen.options import Share


class ScheduledSampling:
    """Two passes: the first on the true past, the second on a past in which predicted frames replace true ones.

    Before `activate` it is teacher forcing. From there the ratio of predicted frames rises linearly, from 0 to 1 at
    `accomplish`; both are fractions of the run (the paper's epochs 250 and 750 of 1000). In a share of the steps, which
    rises with the ratio to `rollouts`, the second pass sees what the decoder generates by itself from the last initial
    pose on, so that a short run, too, meets errors that have grown over the whole motion. The paper has no rollouts.
    """

    needs_past: ClassVar[bool] = True

    def __init__(self, *, activate: Share, accomplish: Share, rollouts: Share = 0.0) -> None:
        self.ratio = LinearRamp(activate, accomplish)
        self.rollouts = rollouts

    def __call__(
        self, decoder: Decoder, controls: Controls, batch: MotionBatch, progress: float, generator: torch.Generator
    ) -> Prediction:
        past = batch.past
        first = decoder(controls, batch.condition, past)
        if progress < self.ratio.start:
            return Prediction(first)
        ratio = self.ratio(progress)
        if torch.rand((), generator=generator) < self.rollouts * ratio:
            with torch.no_grad():
                fed_back = _late(past, decoder.generate(controls, batch.condition))
        else:
            is_predicted = torch.rand(past.shape[:2], generator=generator).to(past.device) < ratio
            fed_back = torch.where(is_predicted.unsqueeze(-1), _late(past, first.detach()), past)
        return Prediction(decoder(controls, batch.condition, fed_back), first_pass=first)


def _late(past: Tensor, predicted: Tensor) -> Tensor:
    """Predicted motion (B, T, F) as a past: one frame late, behind the pose that is given."""
    return torch.cat([past[:, :1], predicted[:, :-1]], dim=1)
