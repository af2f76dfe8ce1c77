"""Statistics that padded frames do not enter."""

from __future__ import annotations

import torch
from torch import Tensor, nn


def masked_mean(frames: Tensor, mask: Tensor) -> Tensor:
    """Mean of the valid frames (B, T, C) under mask (B, T), (B, C)."""
    total = frames.masked_fill(~mask.unsqueeze(-1), 0.0).sum(dim=1)
    return total / mask.sum(dim=1, keepdim=True).clamp(min=1)


class MaskedBatchNorm(nn.Module):
    """Batch norm (Ioffe and Szegedy 2015) of the valid frames: no others enter the statistics, running or not.

    Args:
        channels: numbers that are normalized, each over all clips, frames and what lies between (joints).
    """

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.norm = nn.BatchNorm1d(channels)

    def forward(self, frames: Tensor, mask: Tensor) -> Tensor:
        """Frames (B, T, ..., C) under mask (B, T) to the same shape; padded frames become zero."""
        valid = frames[mask]  # (N, ..., C)
        normal = torch.zeros_like(frames)
        normal[mask] = self.norm(valid.flatten(0, -2)).view_as(valid)
        return normal
