"""Shadow Start (Neural Marionette, section 4.3, "Projection based Shadow Start", Eq. 6)."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor

from motiongen.contracts import Condition, GeneratorModule
from motiongen.generation.bank import TaggedBank
from motiongen.options import PositiveInt
from motiongen.recognition.recognizer import Recognizer
from motiongen.synthesis.correction import Continued


class ShadowStart:
    """Begins every action from its begin-of-pose embedding projected onto those of the training clips.

    Args:
        neighbours: N, how many embeddings of the action's training clips span the plane. The paper does not say.
        normalize: whether the projection is rescaled to the mean norm of the training clips' embeddings.

    Raises:
        CompositionError: when called, for a generator that does not begin with an embedded pose.
    """

    asks_recognizer: ClassVar[bool] = False

    def __init__(self, *, neighbours: PositiveInt = 8, normalize: bool = True) -> None:
        self.neighbours = neighbours
        self.normalize = normalize

    def __call__(
        self, generator: GeneratorModule, condition: Condition, seed: int, recognizer: Recognizer | None
    ) -> Continued:
        motion = generator.generate_from(self.project, condition, seed)
        return Continued(motion, torch.ones(len(motion), dtype=torch.bool, device=motion.device))

    def project(self, embedding: Tensor, tags: Tensor, bank: TaggedBank) -> Tensor:
        """f_0 (B, D) to f*_0 (B, D); unchanged where no training clip shares a tag with the action."""
        if not len(bank):
            return embedding
        candidates = bank.likest(tags)  # (B, M)
        distance = torch.cdist(embedding, bank.entries).masked_fill(~candidates, torch.inf)
        nearest = distance.topk(min(self.neighbours, len(bank)), largest=False)
        # Rows of zeros stand for neighbours that an action does not have: they span nothing.
        span = bank.entries[nearest.indices] * nearest.values.isfinite().unsqueeze(-1)  # F~, (B, N, D)
        span = span.double()  # training clips are alike, so that the least squares are badly conditioned
        shares = embedding.double().unsqueeze(1) @ torch.linalg.pinv(span)  # Phi*, (B, 1, N)
        projected = (shares @ span).squeeze(1).to(embedding)
        if self.normalize:
            norm = bank.entries.norm(dim=-1).mean()
            projected = norm * torch.nn.functional.normalize(projected, dim=-1)
        return torch.where(candidates.any(dim=1, keepdim=True), projected, embedding)
