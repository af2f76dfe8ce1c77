"""What fills the hierarchical RVAE's own slots.

Shapes: B batch, T frames, P numbers of a pose, N words, W numbers of a word, A attribute features, H state.
"""

from __future__ import annotations

from typing import Protocol

import torch
from torch import Tensor, nn

from motiongen.contracts import Posterior


class WordCoder(Protocol):
    """Runs of poses as words."""

    frames: int
    """l, poses in a word."""
    width: int
    """W"""
    output: nn.Module
    """The activation that a word ends with."""

    def encode(self, poses: Tensor) -> Tensor:
        """(B, N l, P) to (B, N, W)."""
        ...

    def decode(self, words: Tensor) -> Tensor:
        """(B, N, W) to (B, N l, P)."""
        ...


class WordStep(Protocol):
    """What a cell made of one word."""

    @property
    def latent(self) -> Tensor:
        """(B, D), as it was drawn"""
        ...

    @property
    def word(self) -> Tensor:
        """(B, W)"""
        ...

    @property
    def state(self) -> Tensor:
        """(B, H)"""
        ...


class Cell(Protocol):
    """A recurrent unit over words."""

    state_width: int
    """H"""

    def __call__(
        self, word: Tensor, attributes: Tensor, state: Tensor, dropped: Tensor, generator: torch.Generator
    ) -> tuple[WordStep, Posterior]:
        """One step of training; where `dropped` (B, 1), it goes on from its own word."""
        ...

    def sample(self, attributes: Tensor, state: Tensor, generator: torch.Generator) -> WordStep:
        """One step of generation."""
        ...

    def prior(self, state: Tensor, attributes: Tensor) -> Posterior:
        """The distribution of the latent before a word is seen: (..., H) and (..., A) to (..., D)."""
        ...


class Denoiser(Protocol):
    """Poses to cleaner poses."""

    def clean(self, poses: Tensor, mask: Tensor, progress: float) -> Tensor:
        """Poses (B, T, P), mask (B, T) to the poses (B, T, P) that words are read from, without gradient."""
        ...

    def loss(self, poses: Tensor, mask: Tensor, generator: torch.Generator) -> Tensor:
        """What it learns by, a scalar."""
        ...
