"""What a recognizer is: motion to action, judged by its features and its logits. It never sees generator code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from torch import Tensor, nn

from motiongen.motion.skeleton import Skeleton


@dataclass(frozen=True)
class RecognizerOutput:
    """What a recognizer sees in a batch of motions."""

    logits: Tensor
    """(B, A): one score for every tag."""
    features: Tensor
    """(B, E): the code in which FID, diversity and multimodality measure distances."""


class Recognizer(nn.Module):
    """An action classifier. Padded frames never change what it returns."""

    def forward(self, motion: Tensor, mask: Tensor) -> RecognizerOutput:
        """Classify canonical motion (B, T, 135) whose valid frames are True in mask (B, T)."""
        raise NotImplementedError


class RecognizerBuilder(Protocol):
    """A recognizer whose options are bound (Hydra's `_partial_`), waiting for what the data decides."""

    def __call__(self, *, tags: int, skeleton: Skeleton) -> Recognizer: ...


@dataclass(frozen=True)
class TrainedRecognizer:
    """A recognizer in eval mode, with what a reader of its figures has to know."""

    recognizer: Recognizer
    test_accuracy: float
    """Share of the real test clips that it recognizes, 0 to 1."""
    fingerprint: str
    """Hex digest of the data and settings that it was trained with."""
    data_fingerprint: str
    """That of the data and split that it was trained on."""
    was_trained: bool
    """Whether this call trained it; otherwise it came from the cache."""
