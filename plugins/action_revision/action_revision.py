"""Action Revision (Neural Marionette, section 4.3, "Recognition based Action Revision", Algorithm 1)."""

from __future__ import annotations

from typing import ClassVar

import torch

from motiongen.contracts import Condition, GeneratorModule
from motiongen.evaluation.metrics.classification import hits
from motiongen.recognition.recognizer import Recognizer
from motiongen.synthesis.correction import Continued, Correction, Uncorrected

ANOTHER = 1_000_003
"""Added to the seed for the second attempt, which would otherwise be the first one again where nothing else differs."""


class ActionRevision:
    """Generates an action, asks the recognizer what it is, and where it is another one, generates it once more.

    Args:
        retry: how the second attempt is made. The paper's is Shadow Start.
    """

    asks_recognizer: ClassVar[bool] = True

    def __init__(self, *, retry: Correction) -> None:
        self.first = Uncorrected()
        self.retry = retry

    def __call__(
        self, generator: GeneratorModule, condition: Condition, seed: int, recognizer: Recognizer | None
    ) -> Continued:
        """Raises ValueError without a recognizer."""
        if recognizer is None:
            raise ValueError("action revision needs a recognizer")
        made = self.first(generator, condition, seed, recognizer)
        with torch.inference_mode():
            wrong = ~hits(recognizer(made.motion, condition.mask).logits, condition.tags)
        if not wrong.any():
            return made
        again = self.retry(generator, condition.rows(wrong), seed + ANOTHER, recognizer)
        motion, jumps = made.motion.clone(), made.jumps.clone()
        motion[wrong], jumps[wrong] = again.motion, again.jumps
        return Continued(motion, jumps)
