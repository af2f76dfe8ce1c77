"""Attribute classifiers over poses (Ghorbani et al. 2020, section 3.4 and Table 1)."""

from __future__ import annotations

from itertools import pairwise

from torch import Tensor, nn

from motiongen.options import PositiveInt


class AttributeClassifier(nn.Module):
    """3 x [Conv1D + ReLU], adaptive average pooling over the valid frames, one fully connected layer.

    Args:
        pose_width: P, numbers of a pose.
        classes: C, values of the attribute.
        layers: convolutions.
        width: their channels.
        kernel: frames that each looks at, odd.

    Raises:
        ValueError: an even kernel.
    """

    def __init__(
        self, pose_width: int, classes: int, *, layers: PositiveInt, width: PositiveInt, kernel: PositiveInt
    ) -> None:
        super().__init__()
        if kernel % 2 == 0:
            raise ValueError(f"generator.classifier.kernel is odd, not {kernel}")
        sizes = [pose_width] + [width] * layers
        self.convolutions = nn.ModuleList(
            nn.Conv1d(before, after, kernel, padding=kernel // 2) for before, after in pairwise(sizes)
        )
        self.logits = nn.Linear(width, classes)

    def forward(self, poses: Tensor, mask: Tensor) -> tuple[Tensor, tuple[Tensor, ...]]:
        """Poses (B, T, P), mask (B, T) to logits (B, C) and every layer's features (B, T, width), zero where padded."""
        valid = mask.unsqueeze(1)
        signal = poses.transpose(1, 2) * valid
        features = []
        for convolution in self.convolutions:
            # Padding looks to a convolution as the end of the motion does: zero.
            signal = convolution(signal).relu() * valid
            features.append(signal.transpose(1, 2))
        pooled = signal.sum(dim=2) / valid.sum(dim=2)
        return self.logits(pooled), tuple(features)
