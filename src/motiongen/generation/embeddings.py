"""Embeddings that stages share."""

from __future__ import annotations

from torch import nn

from motiongen.contracts import Dimensions


class Embeddings:
    """One pose and one tag embedding for all stages of a generator (Neural Marionette, supplement Table 2).

    Not a module: a stage that uses an embedding registers it as its own child, so that stages share it by identity, and
    a generator whose stages do not use it has no such parameters.
    """

    def __init__(self, dimensions: Dimensions) -> None:
        self.pose = nn.Sequential(nn.Linear(dimensions.features, dimensions.width), nn.ReLU())
        """(..., F) to (..., D)"""
        self.tags = nn.Sequential(nn.Linear(dimensions.tags, dimensions.width), nn.ReLU())
        """(..., A) multi-hot to (..., D)"""
