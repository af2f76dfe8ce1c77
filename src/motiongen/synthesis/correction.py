"""How the next action is made from the frames before it: the slot `correction`, whose plugins act against drift."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import torch
from torch import Tensor

from motiongen.contracts import Condition, GeneratorModule
from motiongen.recognition.recognizer import Recognizer


@dataclass(frozen=True)
class Continued:
    """Actions that were generated, in their canonical frames."""

    motion: Tensor
    """(B, T, F)"""
    jumps: Tensor
    """(B,) bool: which of them may begin with another pose than the one before them, so that the seam is smoothed."""


class Correction(Protocol):
    """Generates the next action of a batch of long motions."""

    asks_recognizer: ClassVar[bool]
    """Whether it needs a recognizer."""

    def __call__(
        self, generator: GeneratorModule, condition: Condition, seed: int, recognizer: Recognizer | None
    ) -> Continued: ...


class Uncorrected:
    """The pure generative pipeline: what the generator makes is taken (Neural Marionette, supplement, Algorithm 1).

    A generator that does not read the frames before the action begins with a pose of its own; its seams are smoothed.
    """

    asks_recognizer: ClassVar[bool] = False

    def __call__(
        self, generator: GeneratorModule, condition: Condition, seed: int, recognizer: Recognizer | None
    ) -> Continued:
        motion = generator.generate(condition, seed)
        jumps = "initial_motion" not in generator.reads
        return Continued(motion, torch.full((len(motion),), jumps, device=motion.device))
