"""Gating-adjacency graph convolution (GAGCN; Zhong et al. 2022, which UM-CVAE, section 3.1, builds on)."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch import Tensor, nn

from motiongen.generation.pooling import masked_mean
from motiongen.options import PositiveInt


class GatingAdjacency(nn.Module):
    """Graph convolution, to be followed by ReLU, whose adjacency matrix is blended anew for every motion.

    K candidate matrices are learned; a gate that sees the motion's mean over time weighs them. The first candidate
    starts as the given graph, the others start at random.

    Args:
        graph: (N, N) adjacency matrix that the first candidate starts as.
        inputs, outputs: features of a node.
        candidates: K.
    """

    def __init__(self, graph: Tensor, inputs: int, outputs: int, *, candidates: PositiveInt) -> None:
        super().__init__()
        nodes = len(graph)
        start = torch.randn(candidates, nodes, nodes) * nodes**-0.5  # keeps the variance of the nodes
        start[0] = graph
        self.candidates = nn.Parameter(start)
        self.gate = nn.Linear(nodes * inputs, candidates)
        self.projection = nn.Linear(inputs, outputs)
        nn.init.kaiming_normal_(self.projection.weight, nonlinearity="relu")

    def forward(self, nodes: Tensor, mask: Tensor) -> Tensor:
        """Nodes (B, T, N, inputs) under mask (B, T) to (B, T, N, outputs)."""
        blend = self.gate(masked_mean(nodes.flatten(2), mask)).softmax(dim=-1)  # (B, K)
        adjacency = torch.einsum("bk,knm->bnm", blend, self.candidates)
        return torch.einsum("bnm,btmc->btnc", adjacency, self.projection(nodes))


def normalized_graph(nodes: int, links: Iterable[tuple[int, int]]) -> Tensor:
    """D^-1/2 (A + I) D^-1/2 of an undirected graph (Kipf and Welling 2017, Eq. 2), (nodes, nodes)."""
    graph = torch.eye(nodes)
    for one, other in links:
        graph[one, other] = graph[other, one] = 1.0
    scale = graph.sum(dim=1).rsqrt()
    return scale.unsqueeze(1) * graph * scale
