"""Scheduled sampling for Transformers (Neural Marionette, supplement section 3, Fig. 2)."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor

from motiongen.contracts import CompositionError, Controls, Decoder, MotionBatch, Prediction
from motiongen.generation.schedules import LinearRamp
from motiongen.options import PositiveInt, Share


class ScheduledSampling:
    """Passes of the decoder: the first on the true past, every further one on a past in which predicted frames of the
    pass before replace true ones. The first and the last one learn.

    The paper has two passes: what is fed back was predicted from true frames, so its errors are those of one frame.
    With n passes they are those of up to n - 1 frames in a row (Duckworth et al. 2019, section 3).

    Before `activate` it is teacher forcing. From there the ratio of predicted frames rises linearly, from 0 to 1 at
    `accomplish`; both are fractions of the run (the paper's epochs 250 and 750 of 1000).

    Raises:
        CompositionError: a single pass.
    """

    needs_past: ClassVar[bool] = True

    def __init__(self, *, activate: Share, accomplish: Share, passes: PositiveInt = 2) -> None:
        if passes < 2:
            raise CompositionError(
                "generator.training.passes: 1 is teacher forcing, choose generator/training=teacher_forcing"
            )
        self.ratio = LinearRamp(activate, accomplish)
        self.passes = passes

    def __call__(
        self, decoder: Decoder, controls: Controls, batch: MotionBatch, progress: float, generator: torch.Generator
    ) -> Prediction:
        past = batch.past
        first = decoder(controls, batch.condition, past)
        if progress < self.ratio.start:
            return Prediction(first)
        is_predicted = torch.rand(past.shape[:2], generator=generator).to(past.device) < self.ratio(progress)
        mixed = fed_back(first, past, is_predicted)
        with torch.no_grad():
            for _ in range(self.passes - 2):
                mixed = fed_back(decoder(controls, batch.condition, mixed), past, is_predicted)
        return Prediction(decoder(controls, batch.condition, mixed), first_pass=first)


def fed_back(prediction: Tensor, past: Tensor, is_predicted: Tensor) -> Tensor:
    """The past (B, T, F) with the frames (B, T) that are predicted, which enter as data, without gradient.

    P'_t stands in for P_t from t = 1 on; P_0 is given.
    """
    predicted = torch.cat([past[:, :1], prediction[:, :-1].detach()], dim=1)
    return torch.where(is_predicted.unsqueeze(-1), predicted, past)
