"""The FiLM parameters of the training motions, by action (UM-CVAE, section 3.1 "Temporal decoder", section 4.4)."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.generation.bank import TaggedBank
from motiongen.options import Share


class FilmBank(TaggedBank):
    """The parameters of every training motion."""

    def draw(self, tags: Tensor, otherwise: Tensor, interpolation: Share, generator: torch.Generator) -> Tensor:
        """One set of FiLM parameters for each action, (B, width), from the entries whose tags are most like its own.

        Args:
            tags: (B, A) multi-hot.
            otherwise: (B, width), taken where no entry shares a tag with the action.
            interpolation: with 0 the result is one entry; above 0 it lies between two entries, at most this share of
                the way from the first.
            generator: lives on the CPU.
        """
        if not len(self):
            return otherwise
        candidates = self.likest(tags)
        first, second = (self.entries[_one_of(candidates, generator)] for _ in range(2))
        way = interpolation * torch.rand(len(tags), 1, generator=generator).to(first)
        return torch.where(candidates.any(dim=1, keepdim=True), torch.lerp(first, second, way), otherwise)


def _one_of(candidates: Tensor, generator: torch.Generator) -> Tensor:
    """The index of one True of every row of (B, M) bool, each with the same chance, (B,)."""
    noise = torch.rand(candidates.shape, generator=generator).to(candidates.device)
    return noise.masked_fill(~candidates, -1.0).argmax(dim=1)
