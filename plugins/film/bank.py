"""The FiLM parameters of the training motions, by action (UM-CVAE, section 3.1 "Temporal decoder", section 4.4)."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn

from motiongen.options import Share


class FilmBank(nn.Module):
    """One entry for every training motion: its tags and its FiLM parameters; empty until `fill`.

    The entries are buffers, so they are saved with the weights; loading brings as many entries as were saved.

    Args:
        tags: A, size of the tag vocabulary.
        width: numbers of an entry.
    """

    tags: Tensor
    """(M, A) multi-hot"""
    entries: Tensor
    """(M, width)"""

    def __init__(self, tags: int, width: int) -> None:
        super().__init__()
        self.register_buffer("tags", torch.zeros(0, tags))
        self.register_buffer("entries", torch.zeros(0, width))
        self.register_load_state_dict_pre_hook(_make_room)

    def fill(self, tags: Tensor, entries: Tensor) -> None:
        """Replace what the bank holds: tags (M, A), entries (M, width)."""
        self.tags, self.entries = tags, entries

    def draw(self, tags: Tensor, otherwise: Tensor, interpolation: Share, generator: torch.Generator) -> Tensor:
        """One set of FiLM parameters for each action, (B, width), from the entries whose tags are most like its own.

        Args:
            tags: (B, A) multi-hot.
            otherwise: (B, width), taken where no entry shares a tag with the action.
            interpolation: with 0 the result is one entry; above 0 it lies between two entries, at most this share of
                the way from the first.
            generator: lives on the CPU.
        """
        if not len(self.entries):
            return otherwise
        likeness = jaccard(tags, self.tags)  # (B, M)
        best = likeness.max(dim=1, keepdim=True).values
        first, second = (self.entries[_one_of(likeness == best, generator)] for _ in range(2))
        way = interpolation * torch.rand(len(tags), 1, generator=generator).to(first)
        return torch.where(best > 0, torch.lerp(first, second, way), otherwise)


def jaccard(tags: Tensor, others: Tensor) -> Tensor:
    """Tags in common as a share of all tags that either has: (B, A) and (M, A) multi-hot to (B, M)."""
    common = tags @ others.T
    either = tags.sum(dim=1, keepdim=True) + others.sum(dim=1) - common
    return common / either.clamp(min=1)


def _one_of(candidates: Tensor, generator: torch.Generator) -> Tensor:
    """The index of one True of every row of (B, M) bool, each with the same chance, (B,)."""
    noise = torch.rand(candidates.shape, generator=generator).to(candidates.device)
    return noise.masked_fill(~candidates, -1.0).argmax(dim=1)


def _make_room(bank: FilmBank, state: dict[str, Any], prefix: str, *_: Any) -> None:
    """Loading fills buffers of the shape that they have, so they get the saved number of entries first."""
    for name in ("tags", "entries"):
        saved, here = state.get(prefix + name), getattr(bank, name)
        if saved is not None:
            setattr(bank, name, here.new_zeros(len(saved), here.shape[1]))
