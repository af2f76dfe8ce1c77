"""Entries computed from the training motions once training is over, kept with the weights and looked up by action."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn


class TaggedBank(nn.Module):
    """One entry for every training motion, with the motion's tags; empty until `fill`.

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

    def __len__(self) -> int:
        return len(self.entries)

    def fill(self, tags: Tensor, entries: Tensor) -> None:
        """Replace what the bank holds: tags (M, A), entries (M, width)."""
        self.tags, self.entries = tags, entries

    def likest(self, tags: Tensor) -> Tensor:
        """Which entries have tags most like those of each action, (B, M) bool; none where no entry shares a tag.

        Args:
            tags: (B, A) multi-hot.
        """
        likeness = jaccard(tags, self.tags)
        return (likeness > 0) & (likeness == likeness.max(dim=1, keepdim=True).values)


def jaccard(tags: Tensor, others: Tensor) -> Tensor:
    """Tags in common as a share of all tags that either has: (B, A) and (M, A) multi-hot to (B, M)."""
    common = tags @ others.T
    either = tags.sum(dim=1, keepdim=True) + others.sum(dim=1) - common
    return common / either.clamp(min=1)


def _make_room(bank: TaggedBank, state: dict[str, Any], prefix: str, *_: Any) -> None:
    """Loading fills buffers of the shape that they have, so they get the saved number of entries first."""
    for name in ("tags", "entries"):
        saved, here = state.get(prefix + name), getattr(bank, name)
        if saved is not None:
            setattr(bank, name, here.new_zeros(len(saved), here.shape[1]))
