"""How a generator's weights follow the gradient: an optimizer and its learning rate over the run."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from torch import nn
from torch.optim import Optimizer

from motiongen.options import Share


@dataclass(frozen=True, kw_only=True)
class Optimization:
    """An optimizer whose learning rate may rise linearly at first, and then falls along a half cosine or stays."""

    optimizer: Callable[[Iterator[nn.Parameter]], Optimizer]
    """From parameters to an optimizer at the first learning rate."""
    final_rate: Share = 1.0
    """The share of the first learning rate that is left at the end of the run; 1 keeps it constant (the papers)."""

    warmup: Share = 0.0
    """The share of the run over which the learning rate rises from 0."""

    def factor(self, progress: float) -> float:
        """The learning rate at `progress` in [0, 1] of the run, as a share of the first."""
        rise = min(1.0, progress / self.warmup) if self.warmup else 1.0
        return rise * (self.final_rate + (1 - self.final_rate) * 0.5 * (1 + math.cos(math.pi * progress)))
