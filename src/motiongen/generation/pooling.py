"""Sequences of any length to one vector."""

from __future__ import annotations

import torch
from torch import Tensor


def masked_mean(tokens: Tensor, mask: Tensor) -> Tensor:
    """Mean of the valid tokens: (B, L, D) under a mask (B, L) to (B, D); zero where none is valid."""
    total = tokens.masked_fill(~mask.unsqueeze(-1), 0.0).sum(dim=1)
    return total / mask.sum(dim=1, keepdim=True).clamp(min=1)


def segment_means(tokens: Tensor, mask: Tensor, segments: int) -> Tensor:
    """The masked mean of each of `segments` equal parts of every sequence, one behind the other: (B, segments D).

    A token belongs to the part that its place among the valid ones, which come first, falls into. Parts without a
    token, of sequences with fewer tokens than parts, are zero. One part is `masked_mean`.
    """
    lengths = mask.sum(dim=1, keepdim=True).clamp(min=1)
    part = torch.arange(tokens.shape[1], device=tokens.device) * segments // lengths
    inside = (part.unsqueeze(1) == torch.arange(segments, device=tokens.device).view(-1, 1)) & mask.unsqueeze(1)
    weights = inside.to(tokens) / inside.sum(dim=-1, keepdim=True).clamp(min=1)
    return (weights @ tokens.masked_fill(~mask.unsqueeze(-1), 0.0)).flatten(1)
