"""ST-GCN (Yan et al. 2018), which ACTOR judges motion of UESTC by (sections 4.1 and 4.4)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn

from motiongen.errors import InputError
from motiongen.motion.skeleton import JOINTS, PARENTS, Skeleton
from motiongen.options import PositiveInt, Share
from motiongen.recognition.masking import MaskedBatchNorm, masked_mean
from motiongen.recognition.recognizer import Recognizer, RecognizerOutput
from motiongen.recognition.signals import FPS, JOINT_SIGNALS, joint_signals


class STGCNRecognizer(Recognizer):
    """Blocks of graph and temporal convolution; the mean of the last over frames and joints is the motion's code.

    ACTOR looks at rotations, this at places and velocities of joints. The paper's own size is every frame, channels
    [64, 64, 64, 64, 128, 128, 128, 256, 256] and a feature width of 256.

    Args:
        tags: actions to tell apart.
        skeleton: the body whose joints it looks at.
        channels: those of all blocks but the last. Where they grow, the frame rate is halved, as in the paper.
        every: frames of the motion for one that is looked at. Four tell actions apart at a quarter of the cost.
        kernel: frames that a temporal convolution sees at once, an odd number.
        dropout: at the end of every block's inner path, while training.
        feature_width: channels of the last block. FID needs more samples than this to be of full rank.

    Raises:
        InputError: an even kernel.
    """

    def __init__(
        self,
        *,
        tags: PositiveInt,
        skeleton: Skeleton,
        channels: Sequence[PositiveInt] = (16, 32),
        every: PositiveInt = 4,
        kernel: PositiveInt = 9,
        dropout: Share = 0.3,
        feature_width: PositiveInt = 64,
    ) -> None:
        super().__init__()
        if kernel % 2 == 0:
            raise InputError(f"recognizer.network.kernel: {kernel} frames have no middle one; take an odd number")
        self.register_buffer("offsets", skeleton.offsets.clone())
        self.every = every
        self.norm = MaskedBatchNorm(JOINTS * JOINT_SIGNALS)
        widths = [*channels, feature_width]
        blocks = [Block(JOINT_SIGNALS, widths[0], kernel=kernel, stride=1, dropout=dropout)]
        for inputs, outputs in pairwise(widths):
            stride = 2 if outputs > inputs else 1
            blocks.append(Block(inputs, outputs, kernel=kernel, stride=stride, dropout=dropout))
        self.blocks = nn.ModuleList(blocks)
        self.to_logits = nn.Linear(feature_width, tags)

    def forward(self, motion: Tensor, mask: Tensor) -> RecognizerOutput:
        """Motion (B, T, 135), mask (B, T) to logits (B, A) and features (B, E)."""
        motion, mask = motion[:, :: self.every], mask[:, :: self.every]
        signals = joint_signals(motion, mask, Skeleton(self.get_buffer("offsets")), FPS / self.every)
        joints = self.norm(signals.flatten(2), mask).unflatten(2, (JOINTS, JOINT_SIGNALS))  # (B, T, 22, 6)
        for block in self.blocks:
            joints = block(joints, mask)
            mask = mask[:, :: block.stride]
        features = masked_mean(joints.mean(dim=2), mask)
        return RecognizerOutput(logits=self.to_logits(features), features=features)


class Block(nn.Module):
    """Graph convolution, temporal convolution and the way around both ("Network architecture and training").

    Args:
        inputs, outputs: channels of a joint.
        kernel: frames of the temporal convolution.
        stride: frames of the input for one of the output.
        dropout: of what is added to the way around, while training.
    """

    def __init__(self, inputs: int, outputs: int, *, kernel: int, stride: int, dropout: float) -> None:
        super().__init__()
        self.stride = stride
        self.graph = GraphConvolution(inputs, outputs, spatial_partition())
        self.graph_norm = MaskedBatchNorm(outputs)
        # No offsets where a norm follows: it would take them away.
        self.time = nn.Conv2d(outputs, outputs, (kernel, 1), (stride, 1), (kernel // 2, 0), bias=False)
        self.time_norm = MaskedBatchNorm(outputs)
        self.dropout = nn.Dropout(dropout)
        same = inputs == outputs and stride == 1
        self.around = None if same else nn.Linear(inputs, outputs, bias=False)
        self.around_norm = None if same else MaskedBatchNorm(outputs)

    def forward(self, joints: Tensor, mask: Tensor) -> Tensor:
        """Joints (B, T, 22, inputs) under mask (B, T) to (B, ceil(T / stride), 22, outputs); padded frames are zero."""
        later = mask[:, :: self.stride]
        found = torch.relu(self.graph_norm(self.graph(joints), mask))
        found = self.time(found.permute(0, 3, 1, 2)).permute(0, 2, 3, 1)
        found = self.dropout(self.time_norm(found, later))
        if self.around is not None and self.around_norm is not None:
            joints = self.around_norm(self.around(joints[:, :: self.stride]), later)
        return torch.relu(found + joints)


class GraphConvolution(nn.Module):
    """Every joint from its neighbours, each part of the neighbourhood by weights of its own (Yan et al. 2018, Eq. 10).

        y_i = sum over k, j of A_kij M_kij W_k x_j

    The edges' importance M is learned ("Learnable edge importance weighting").

    Args:
        inputs, outputs: channels of a joint.
        adjacency: A, (K, 22, 22).
    """

    def __init__(self, inputs: int, outputs: int, adjacency: Tensor) -> None:
        super().__init__()
        self.register_buffer("adjacency", adjacency)
        self.importance = nn.Parameter(torch.ones_like(adjacency))
        self.projection = nn.Linear(len(adjacency) * inputs, outputs, bias=False)

    def forward(self, joints: Tensor) -> Tensor:
        """Joints (B, T, 22, inputs) to (B, T, 22, outputs)."""
        edges = (self.get_buffer("adjacency") * self.importance).transpose(0, 1).flatten(0, 1)  # (22 * K, 22)
        # Gathered before they are projected, while channels are few; frame by frame, or matmul would copy them all.
        poses = joints.flatten(0, 1)  # (B * T, 22, inputs)
        parts = torch.bmm(edges.expand(len(poses), -1, -1), poses)  # (B * T, 22 * K, inputs)
        return self.projection(parts.view(*joints.shape[:3], -1))


def spatial_partition() -> Tensor:
    """The neighbourhood of every joint in three parts (Yan et al. 2018, "Partition Strategies", Eq. 8), (3, 22, 22).

    Entry [k, i, j] is what joint i takes from joint j: from itself, from its parent, which is nearer to the pelvis
    (centripetal), and from its children, which are farther (centrifugal). Together they average the neighbourhood, as
    in the published code. (There, all distances beyond one edge count as equal, so that the outer edges are not
    told apart.)
    """
    parts = torch.zeros(3, JOINTS, JOINTS)
    parts[0] = torch.eye(JOINTS)
    for joint, parent in enumerate(PARENTS[1:], start=1):
        parts[1, joint, parent] = 1.0
        parts[2, parent, joint] = 1.0
    return parts / parts.sum(dim=(0, 2)).unsqueeze(1)
