"""Fully connected layers."""

from __future__ import annotations

from itertools import pairwise

from torch import nn

from motiongen.options import PositiveInt, Share


def perceptron(inputs: PositiveInt, hidden: PositiveInt, layers: PositiveInt, dropout: Share) -> nn.Sequential:
    """`layers` times linear, GELU and dropout: (..., inputs) to (..., hidden)."""
    widths = [inputs, *[hidden] * layers]
    parts: list[nn.Module] = []
    for width, following in pairwise(widths):
        parts += [nn.Linear(width, following), nn.GELU(), nn.Dropout(dropout)]
    return nn.Sequential(*parts)
