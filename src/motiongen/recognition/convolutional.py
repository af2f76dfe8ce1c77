"""Convolutions over time (the classifiers of the hierarchical RVAE, Ghorbani et al. 2020, section 4, Table 1)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from motiongen.motion.skeleton import Skeleton
from motiongen.options import PositiveInt
from motiongen.recognition.masking import masked_mean
from motiongen.recognition.recognizer import Recognizer, RecognizerOutput
from motiongen.recognition.signals import SIGNALS, body_signals


class ConvolutionalRecognizer(Recognizer):
    """Layers of Conv1D and ReLU, the mean of the valid frames, a linear layer to the motion's code.

    The paper tells neither width nor kernel, and goes from the mean to the logits at once; the layer between gives the
    code a width of its own, so that figures of recognizers of any width need equally many samples.

    Args:
        tags: actions to tell apart.
        skeleton: the body whose joints it looks at.
        width: channels of every convolution.
        kernel: frames that a convolution sees at once.
        layers: convolutions.
        feature_width: numbers in the motion's code. FID needs more samples than this to be of full rank.
    """

    def __init__(
        self,
        *,
        tags: PositiveInt,
        skeleton: Skeleton,
        width: PositiveInt = 128,
        kernel: PositiveInt = 5,
        layers: PositiveInt = 3,
        feature_width: PositiveInt = 64,
    ) -> None:
        super().__init__()
        self.register_buffer("offsets", skeleton.offsets.clone())
        inputs = [SIGNALS, *[width] * (layers - 1)]
        convolutions = [nn.Conv1d(channels, width, kernel, padding="same") for channels in inputs]
        for convolution in convolutions:
            # torch's default forgets the ReLU: the mean would hardly vary with the motion at first.
            nn.init.kaiming_normal_(convolution.weight, nonlinearity="relu")
        self.convolutions = nn.ModuleList(convolutions)
        self.to_features = nn.Linear(width, feature_width)
        self.to_logits = nn.Linear(feature_width, tags)

    def forward(self, motion: Tensor, mask: Tensor) -> RecognizerOutput:
        """Motion (B, T, 135), mask (B, T) to logits (B, A) and features (B, E)."""
        frames = body_signals(motion, mask, Skeleton(self.get_buffer("offsets"))).transpose(1, 2)  # (B, C, T)
        for convolution in self.convolutions:
            # Padded frames count as zeros in every layer, like those before the first and after the last.
            frames = torch.relu(convolution(frames)) * mask.unsqueeze(1)
        features = self.to_features(masked_mean(frames.transpose(1, 2), mask))
        return RecognizerOutput(logits=self.to_logits(features), features=features)
