"""Sinusoidal positional encoding (Vaswani et al. 2017, section 3.5)."""

from __future__ import annotations

import math

import torch
from torch import Tensor


def sinusoidal(positions: Tensor, width: int) -> Tensor:
    """Positions (...) of any numeric type to codes (..., width): sines in even features, cosines in odd ones."""
    exponents = torch.arange(0, width, 2, device=positions.device) * (-math.log(10000.0) / width)
    angles = positions.unsqueeze(-1) * exponents.exp()
    return torch.stack([angles.sin(), angles.cos()], dim=-1).flatten(-2)[..., :width]
