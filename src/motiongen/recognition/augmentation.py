"""Label-safe changes to training motion. Mirroring is not among them: it turns a left wave into a right one."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from motiongen.motion.canonical import GroundFrame
from motiongen.options import NonNegativeFloat, Share


@dataclass(frozen=True, kw_only=True)
class Augmentation:
    """How far training motion may differ from the recorded one; all zero leaves it alone."""

    tempo: Share = 0.15
    """Largest share by which a clip is played faster or slower."""
    yaw: NonNegativeFloat = 0.2
    """Standard deviation of a turn about the vertical, radians."""
    noise: NonNegativeFloat = 0.01
    """Standard deviation of noise on the features of every frame, metres or 6D units."""

    def __call__(self, motion: Tensor, mask: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """Motion (B, T, 135) and mask (B, T) to new ones, whose T differs with the tempo."""
        motion, mask = change_tempo(motion, mask, self._spread(len(motion), generator) * self.tempo + 1)
        yaw = torch.randn(len(motion), generator=generator) * self.yaw
        motion = GroundFrame(yaw, torch.zeros(len(motion), 2)).leave(motion)
        return motion + torch.randn(motion.shape, generator=generator) * self.noise, mask

    def _spread(self, count: int, generator: torch.Generator) -> Tensor:
        return torch.rand(count, generator=generator) * 2 - 1


def change_tempo(motion: Tensor, mask: Tensor, factor: Tensor) -> tuple[Tensor, Tensor]:
    """Play clips (B, T, 135) at `factor` (B,) times their speed; the first frame stays the first.

    Features are interpolated linearly between neighbouring frames, which are close enough for that.

    Returns:
        Motion (B, T', 135) and mask (B, T'), T' being the longest new length; padding is zero.
    """
    last = mask.sum(dim=1) - 1
    frames = int((last / factor + 1e-4).floor().max()) + 1
    time = torch.arange(frames) * factor.unsqueeze(1)
    valid = time <= last.unsqueeze(1) + 1e-4
    before = time.floor().long().minimum(last.unsqueeze(1))
    after = (before + 1).minimum(last.unsqueeze(1))
    rows = torch.arange(len(motion)).unsqueeze(1)
    share = (time - before).clamp(0, 1).unsqueeze(-1)
    return torch.lerp(motion[rows, before], motion[rows, after], share) * valid.unsqueeze(-1), valid
