"""The floor under a long motion, whose height drifts where a generator adds displacements."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from motiongen.data.datamodule import MotionData
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import TRANSLATION
from motiongen.motion.skeleton import Skeleton

RISE = 10
"""Frames within which a motion comes to the floor."""
BATCH = 256


@dataclass(frozen=True)
class Floor:
    """Puts motions on the floor. Every action touches it at some time, also a jump."""

    skeleton: Skeleton
    resting: float
    """Metres: how high the lowest joint is when the body stands"""

    @classmethod
    def of(cls, data: MotionData) -> Floor:
        """The floor of the training clips: the median of their lowest joints' least heights."""
        least = []
        for batch in data.train_windows(BATCH):
            heights = _lowest(batch.motion, data.skeleton)
            least.append(heights.masked_fill(~batch.condition.mask, torch.inf).amin(dim=1))
        return cls(data.skeleton, float(torch.cat(least).median()))

    def __call__(self, motion: Tensor, mask: Tensor) -> Tensor:
        """Motion (B, T, 135) raised or lowered, within RISE frames, so that its lowest joint just reaches the floor.

        Motion that is on the floor already stays as it is. mask (B, T) is True for frames that count.
        """
        heights = _lowest(motion, self.skeleton).masked_fill(~mask, torch.inf)
        off = heights.amin(dim=1) - self.resting  # (B,)
        share = (torch.arange(1, motion.shape[1] + 1, device=motion.device) / RISE).clamp(max=1)
        moved = motion.clone()
        moved[..., TRANSLATION.stop - 1] -= off.unsqueeze(-1) * share
        return moved


def _lowest(motion: Tensor, skeleton: Skeleton) -> Tensor:
    """The height of the lowest joint, (B, T)."""
    return joint_positions(motion, skeleton)[..., 2].amin(dim=-1)
