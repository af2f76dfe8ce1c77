"""Convolutions over time that padding does not touch (Bai et al. 2018; UM-CVAE, section 3.1)."""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from motiongen.generation.pooling import masked_mean
from motiongen.options import PositiveInt

DILATIONS = (1, 2, 4)
NORM_EPSILON = 1e-5


def dilation_of(layer: int) -> int:
    """The dilation of a stack's layer, counted from 0: 1, 2, 4, 1, 2, 4, ..."""
    return DILATIONS[layer % len(DILATIONS)]


class TemporalConvolution(nn.Module):
    """ReLU of a dilated convolution over time that keeps the length; a frame sees as far ahead as back.

    Padded frames count as zeros, like those before the first and after the last.

    Args:
        inputs, outputs: channels.
        kernel: frames of the kernel.
        dilation: frames between two of them.
    """

    def __init__(self, inputs: int, outputs: int, *, kernel: PositiveInt, dilation: PositiveInt) -> None:
        super().__init__()
        self.convolution = nn.Conv1d(inputs, outputs, kernel, dilation=dilation, padding="same")
        # torch's default forgets the ReLU: what a stack of six gives would hardly vary with its input at first.
        nn.init.kaiming_normal_(self.convolution.weight, nonlinearity="relu")

    def forward(self, frames: Tensor, mask: Tensor) -> Tensor:
        """Frames (B, T, inputs) under mask (B, T) to (B, T, outputs)."""
        valid = frames.masked_fill(~mask.unsqueeze(-1), 0.0)
        return F.relu(self.convolution(valid.transpose(1, 2)).transpose(1, 2))


class MaskedInstanceNorm(nn.Module):
    """Every channel of every motion to mean 0 and variance 1 over its valid frames (Ulyanov et al. 2016), no scale."""

    def forward(self, frames: Tensor, mask: Tensor) -> Tensor:
        """Frames (B, T, C) under mask (B, T) to (B, T, C)."""
        centred = frames - masked_mean(frames, mask).unsqueeze(1)
        variance = masked_mean(centred.square(), mask).unsqueeze(1)
        return centred * torch.rsqrt(variance + NORM_EPSILON)
