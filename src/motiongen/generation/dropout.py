"""Dropout whose masks cost little without a GPU."""

from __future__ import annotations

import torch
from torch import Tensor, nn

LEVELS = 2**16
"""Of the rate: it is a whole number of these parts of 1."""


class QuickDropout(nn.Dropout):
    """As `nn.Dropout`; on the CPU a mask takes four elements' random numbers from one draw of 64 bits.

    torch draws a number for every element there, one after another, which takes a quarter of a training step at the
    papers' scale. Like `nn.Dropout` it draws from torch's global generator.
    """

    def forward(self, input: Tensor) -> Tensor:
        if not self.training or input.device.type != "cpu" or self.p in (0.0, 1.0):
            return super().forward(input)
        dropped = min(round(self.p * LEVELS), LEVELS - 1)
        draws = torch.empty(-(-input.numel() // 4), dtype=torch.int64).random_(-(2**63), 2**63 - 1)
        keep = draws.view(torch.int16)[: input.numel()].view(input.shape) >= dropped - LEVELS // 2
        return input * keep * (LEVELS / (LEVELS - dropped))


def with_quick_dropout(module: nn.Module) -> None:
    """Replace every `nn.Dropout` within, also those that torch's own layers make."""
    for parent in module.modules():
        for name, child in parent.named_children():
            if type(child) is nn.Dropout:
                setattr(parent, name, QuickDropout(child.p))
