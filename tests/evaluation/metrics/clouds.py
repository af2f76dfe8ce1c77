"""Sets of features that several tests share."""

from __future__ import annotations

import torch
from torch import Tensor


def samples(count: int, width: int, seed: int) -> Tensor:
    """Correlated Gaussian samples (count, width) around `seed`, float64."""
    generator = torch.Generator().manual_seed(seed)
    mixing = torch.randn(width, width, generator=generator, dtype=torch.float64)
    return torch.randn(count, width, generator=generator, dtype=torch.float64) @ mixing + seed


def turn(width: int) -> Tensor:
    """An orthogonal matrix (width, width)."""
    return torch.linalg.qr(samples(width, width, 7)).Q
