"""Paths on the floor for actions that travel, where the user draws none."""

from __future__ import annotations

import torch
from torch import Tensor


def fit_path(path: Tensor, frames: int) -> Tensor:
    """A recorded path (T, 2), cut to `frames` or continued at the mean velocity of its last half second (15 frames)."""
    if len(path) >= frames:
        return path[:frames]
    tail = path[-16:]
    velocity = (tail[-1] - tail[0]) / max(1, len(tail) - 1)
    ahead = torch.arange(1, frames - len(path) + 1, dtype=path.dtype, device=path.device).unsqueeze(-1)
    return torch.cat([path, path[-1] + ahead * velocity])
