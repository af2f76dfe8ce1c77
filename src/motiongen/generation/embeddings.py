"""How pose features and tags enter a generator, and how poses leave it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from motiongen.contracts import Dimensions

LEAST_DEVIATION = 0.05
"""Features that hardly move in the data are not blown up to the size of those that do."""


@dataclass(frozen=True)
class PoseStatistics:
    """Mean and standard deviation of every pose feature over training frames."""

    mean: Tensor
    """(F,)"""
    deviation: Tensor
    """(F,), at least LEAST_DEVIATION"""

    @classmethod
    def of(cls, motions: Iterable[Tensor]) -> PoseStatistics:
        """Of all frames of motions (T, F) in their canonical frames."""
        frames = torch.cat(list(motions))
        return cls(frames.mean(dim=0), frames.std(dim=0).clamp(min=LEAST_DEVIATION))


class Standardize(nn.Module):
    """(..., F) pose features to zero mean and unit deviation."""

    mean: Tensor
    deviation: Tensor

    def __init__(self, statistics: PoseStatistics) -> None:
        super().__init__()
        self.register_buffer("mean", statistics.mean)
        self.register_buffer("deviation", statistics.deviation)

    def forward(self, features: Tensor) -> Tensor:
        return (features - self.mean) / self.deviation


class Unstandardize(Standardize):
    """The inverse of Standardize."""

    def forward(self, features: Tensor) -> Tensor:
        return features * self.deviation + self.mean


class Embeddings:
    """One pose and one tag embedding for all stages of a generator (Neural Marionette, supplement Table 2).

    Poses are standardized by the training data on their way in, and back on their way out. The papers do not say so; it
    is common practice, and without it a network spends most of its training on the mean pose.

    Not a module: a stage that uses an embedding registers it as its own child, so that stages share it by identity, and
    a generator whose stages do not use it has no such parameters.
    """

    def __init__(self, dimensions: Dimensions, statistics: PoseStatistics) -> None:
        self._dimensions = dimensions
        self._statistics = statistics
        embedding = nn.Linear(dimensions.features, dimensions.width)
        self.pose = nn.Sequential(Standardize(statistics), embedding, nn.ReLU())
        """(..., F) to (..., D)"""
        self.tags = nn.Sequential(nn.Linear(dimensions.tags, dimensions.width), nn.ReLU())
        """(..., A) multi-hot to (..., D)"""

    def pose_output(self) -> nn.Module:
        """A new linear layer from codes (..., D) to poses (..., F)."""
        return nn.Sequential(
            nn.Linear(self._dimensions.width, self._dimensions.features), Unstandardize(self._statistics)
        )
