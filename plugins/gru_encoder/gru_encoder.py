"""The recurrent encoder that ACTOR is compared with (ACTOR, section 4.2 "Architecture design", Table 2 "GRU")."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import nn

from motiongen.contracts import Condition, Dimensions, MotionBatch, Posterior
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.priors import standard_normal
from motiongen.options import PositiveInt


class GruEncoder(nn.Module):
    """Motion and action to the distribution of the code, pooled at the last valid frame.

    Every frame's pose is embedded together with the tags; from the GRU's last output two linear layers give mean and
    log-variance. The prior is N(0, I).
    """

    reads: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, dimensions: Dimensions, embeddings: Embeddings, *, layers: PositiveInt) -> None:
        super().__init__()
        self.width = dimensions.width
        self.embedding = nn.Linear(dimensions.features + dimensions.tags, self.width)
        self.gru = nn.GRU(self.width, self.width, layers, batch_first=True)
        self.mean = nn.Linear(self.width, self.width)
        self.log_variance = nn.Linear(self.width, self.width)

    def posterior(self, batch: MotionBatch) -> Posterior:
        condition = batch.condition
        tags = condition.tags.unsqueeze(1).expand(-1, batch.motion.shape[1], -1)  # (B, T, A)
        outputs, _ = self.gru(self.embedding(torch.cat([batch.motion, tags], dim=-1)))  # (B, T, D)
        # What comes before the last valid frame is valid, too: padding is never read.
        last = outputs[torch.arange(len(outputs), device=outputs.device), condition.lengths - 1]
        return Posterior(self.mean(last), self.log_variance(last))

    def prior(self, condition: Condition) -> Posterior:
        return standard_normal(condition, self.width)
