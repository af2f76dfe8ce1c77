"""Training on motion of the decoder's own making."""

from __future__ import annotations

from typing import ClassVar

import torch

from motiongen.contracts import Controls, Decoder, MotionBatch, Prediction
from motiongen.generation.schedules import LinearRamp
from motiongen.options import Share


class FreeRunning:
    """Two passes: the first on the true past, the second on motion that the decoder generated frame by frame.

    Scheduled sampling shows the decoder errors of one frame. Free running shows it where they lead to, and asks for the
    true next frame from there, as DAgger does (Ross et al. 2011, section 3); Zhou et al. 2018 feed networks of human
    motion stretches of their own motion.

    Before `activate` it is teacher forcing. From there the share of the motions whose past is generated rises linearly,
    from 0 to 1 at `accomplish`; both are fractions of the run.
    """

    needs_past: ClassVar[bool] = True

    def __init__(self, *, activate: Share, accomplish: Share) -> None:
        self.share = LinearRamp(activate, accomplish)

    def __call__(
        self, decoder: Decoder, controls: Controls, batch: MotionBatch, progress: float, generator: torch.Generator
    ) -> Prediction:
        past = batch.past
        first = decoder(controls, batch.condition, past)
        if progress < self.share.start:
            return Prediction(first)
        with torch.no_grad():
            generated = decoder.generate(controls, batch.condition)
        own = torch.cat([past[:, :1], generated[:, :-1]], dim=1)
        # Whole motions: between frames of two motions that have come apart there would be jumps.
        is_own = torch.rand(len(past), 1, 1, generator=generator).to(past.device) < self.share(progress)
        return Prediction(decoder(controls, batch.condition, torch.where(is_own, own, past)), first_pass=first)
