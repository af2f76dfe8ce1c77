"""A denoising autoencoder over poses (Ghorbani et al. 2020, sections 3.1 and 4.2, Table 1)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from motiongen.objectives.terms import squared_error
from motiongen.options import NonNegativeFloat, PositiveInt, Share


class NoDenoiser:
    """The empty filling of the slot: words are read from the motion as it was recorded."""

    def __init__(self, pose_width: int) -> None:
        pass

    def clean(self, poses: Tensor, mask: Tensor, progress: float) -> Tensor:
        """(B, T, P) as they are."""
        return poses

    def loss(self, poses: Tensor, mask: Tensor, generator: torch.Generator) -> Tensor:
        """Nothing to learn: 0."""
        return poses.new_zeros(())


class MotionDenoiser(nn.Module):
    """2 x [Conv1D + ReLU] + ConvTranspose1D + ReLU + ConvTranspose1D, at the motion's own rate.

    Args:
        pose_width: P, numbers of a pose.
        width: channels of the hidden layers.
        kernel: frames that each layer looks at, odd.
        corrupted: share of the input's numbers that noise is added to while it learns.
        noise: standard deviation of this noise.
        ready: share of the run after which its output is used.

    Raises:
        ValueError: an even kernel.
    """

    def __init__(
        self,
        pose_width: int,
        *,
        width: PositiveInt,
        kernel: PositiveInt,
        corrupted: Share,
        noise: NonNegativeFloat,
        ready: Share,
    ) -> None:
        super().__init__()
        if kernel % 2 == 0:
            raise ValueError(f"generator.denoiser.kernel is odd, not {kernel}")
        self.corrupted, self.noise, self.ready = corrupted, noise, ready
        padding = kernel // 2
        self.layers = nn.ModuleList(
            [
                nn.Conv1d(pose_width, width, kernel, padding=padding),
                nn.Conv1d(width, width, kernel, padding=padding),
                nn.ConvTranspose1d(width, width, kernel, padding=padding),
                nn.ConvTranspose1d(width, pose_width, kernel, padding=padding),
            ]
        )

    def forward(self, poses: Tensor, mask: Tensor) -> Tensor:
        """Poses (B, T, P), mask (B, T) to poses (B, T, P), zero where padded."""
        valid = mask.unsqueeze(1)
        signal = poses.transpose(1, 2) * valid
        *hidden, last = self.layers
        for layer in hidden:
            signal = layer(signal).relu() * valid
        return (last(signal) * valid).transpose(1, 2)

    def clean(self, poses: Tensor, mask: Tensor, progress: float) -> Tensor:
        """The poses (B, T, P) to read words from, without gradient: as they are where padded, and until it is ready."""
        if progress < self.ready:
            return poses
        return torch.where(mask.unsqueeze(-1), self(poses, mask).detach(), poses)

    def loss(self, poses: Tensor, mask: Tensor, generator: torch.Generator) -> Tensor:
        """Squared error of the poses (B, T, P) that it makes of corrupted ones, a scalar."""
        chosen = torch.rand(poses.shape, generator=generator) < self.corrupted
        added = self.noise * chosen * torch.randn(poses.shape, generator=generator)
        return squared_error(self(poses + added.to(poses), mask), poses, mask)
