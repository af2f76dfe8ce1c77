"""UM-CVAE's action-aware encoder (section 3.1, Eq. 2)."""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from motiongen.contracts import CompositionError, Dimensions
from motiongen.generation.pooling import masked_mean
from motiongen.generation.temporal_convolution import TemporalConvolution, dilation_of
from motiongen.motion.skeleton import JOINTS, PARENTS
from motiongen.options import PositiveInt
from motiongen_plugins.film.graph_convolution import GatingAdjacency, normalized_graph

POSITION, LABEL, NODES = JOINTS, JOINTS + 1, JOINTS + 2
"""Nodes of the graph: the joints, the pelvis' position, the label joint."""
LINKS = (
    *((child, parent) for child, parent in enumerate(PARENTS) if parent >= 0),
    (POSITION, 0),
    *((LABEL, node) for node in range(LABEL)),
)
"""Bones; the position belongs to the pelvis; the label concerns the whole body."""


class ActionAwareEncoder(nn.Module):
    """Motion and label to spatio-temporal features f_st.

    The label, linearly embedded, joins the joints as one more (label-motion fusion). Graph convolutions mix the nodes
    of every frame, temporal convolutions the frames, and the mean over time is f_st.

    Args:
        channels: features of a node between the graph convolutions.
        graph_layers: graph convolutions.
        candidates: adjacency matrices that each of them blends.
        temporal_layers: temporal convolutions, with dilations 1, 2, 4, repeated.
        kernel: frames of their kernels.

    Raises:
        CompositionError: the pose is not the same count of numbers for each joint and a position.
    """

    def __init__(
        self,
        dimensions: Dimensions,
        *,
        channels: PositiveInt,
        graph_layers: PositiveInt,
        candidates: PositiveInt,
        temporal_layers: PositiveInt,
        kernel: PositiveInt,
    ) -> None:
        super().__init__()
        joint, rest = divmod(dimensions.features - 3, JOINTS)
        if rest:
            raise CompositionError(
                f"film takes poses of {JOINTS} joints and a position, not of {dimensions.features} numbers; "
                "choose another generator/conditioning"
            )
        self.label = nn.Linear(dimensions.tags, joint)
        self.position = nn.Linear(3, joint)
        graph = normalized_graph(NODES, LINKS)
        widths = [joint] + [channels] * graph_layers
        self.spatial = nn.ModuleList(
            GatingAdjacency(graph, widths[layer], channels, candidates=candidates) for layer in range(graph_layers)
        )
        widths = [NODES * channels] + [dimensions.width] * temporal_layers
        self.temporal = nn.ModuleList(
            TemporalConvolution(widths[layer], dimensions.width, kernel=kernel, dilation=dilation_of(layer))
            for layer in range(temporal_layers)
        )

    def forward(self, motion: Tensor, tags: Tensor, mask: Tensor) -> Tensor:
        """Motion (B, T, F) and tags (B, A) under mask (B, T) to f_st (B, D)."""
        nodes = self.fuse(motion, tags)
        for graph in self.spatial:
            nodes = F.relu(graph(nodes, mask))
        frames = nodes.flatten(2)
        for convolution in self.temporal:
            frames = convolution(frames, mask)
        return masked_mean(frames, mask)

    def fuse(self, motion: Tensor, tags: Tensor) -> Tensor:
        """Label-motion fusion: (B, T, F) and (B, A) to the nodes (B, T, 24, features of a joint)."""
        joints, position = motion[..., :-3].unflatten(-1, (JOINTS, -1)), motion[..., -3:]
        label = self.label(tags).unsqueeze(1).expand(-1, motion.shape[1], -1)
        return torch.cat([joints, self.position(position).unsqueeze(2), label.unsqueeze(2)], dim=2)
