"""A GRU (the recognizer of Action2Motion, Guo et al. 2020, section 5.1)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from motiongen.motion.skeleton import Skeleton
from motiongen.options import PositiveInt
from motiongen.recognition.recognizer import Recognizer, RecognizerOutput
from motiongen.recognition.signals import SIGNALS, body_signals


class GRURecognizer(Recognizer):
    """A GRU reads the clip; its state after the last valid frame is the motion's code.

    It starts from a state of zeros. (The published code draws the first state anew at every call, so that the same clip
    is judged differently every time.)

    Args:
        tags: actions to tell apart.
        skeleton: the body whose joints it looks at.
        width: numbers in the GRU's state.
        layers: GRUs on top of each other.
        feature_width: numbers in the motion's code. FID needs more samples than this to be of full rank.
    """

    def __init__(
        self,
        *,
        tags: PositiveInt,
        skeleton: Skeleton,
        width: PositiveInt = 128,
        layers: PositiveInt = 2,
        feature_width: PositiveInt = 64,
    ) -> None:
        super().__init__()
        self.register_buffer("offsets", skeleton.offsets.clone())
        self.gru = nn.GRU(SIGNALS, width, layers, batch_first=True)
        self.to_features = nn.Linear(width, feature_width)
        self.to_logits = nn.Linear(feature_width, tags)

    def forward(self, motion: Tensor, mask: Tensor) -> RecognizerOutput:
        """Motion (B, T, 135), mask (B, T) to logits (B, A) and features (B, E)."""
        signals = body_signals(motion, mask, Skeleton(self.get_buffer("offsets")))
        states, _ = self.gru(signals)  # (B, T, width); what follows a frame does not change its state
        clips = torch.arange(len(states), device=states.device)
        features = torch.tanh(self.to_features(states[clips, mask.sum(dim=1) - 1]))
        return RecognizerOutput(logits=self.to_logits(features), features=features)
