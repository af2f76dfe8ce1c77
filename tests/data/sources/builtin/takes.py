"""A session, posed."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

from motiongen.data.clips import Sequence


@dataclass(frozen=True)
class Take:
    """A session with its rotations (T, 22, 3, 3), world rotations and joint positions (T, 22, 3)."""

    sequence: Sequence
    local: Tensor
    world: Tensor
    joints: Tensor

    def of(self, tag: str) -> list[slice]:
        return [slice(part.start, part.stop) for part in self.sequence.segments if part.tags == (tag,)]
