"""Frame-by-frame evaluation of a causal Transformer decoder, with cached keys and values."""

from __future__ import annotations

from collections.abc import Iterable

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from motiongen.generation.packed import packed_linear


class IncrementalDecoder:
    """Runs trained `nn.TransformerDecoderLayer`s (post-norm, batch first) one frame at a time.

    Gives what the layers give for the whole sequence under a causal mask, at a cost per frame that grows with the cache
    alone: keys and values of the memory are projected once, those of past frames are kept.

    Args:
        layers: the decoder's layers.
        memory: (B, M, D) what every frame attends to.
        memory_mask: (B, M) bool, True where valid.
        frames: the number of steps to come.
    """

    def __init__(
        self, layers: Iterable[nn.TransformerDecoderLayer], memory: Tensor, memory_mask: Tensor, frames: int
    ) -> None:
        self._layers = [_LayerState(layer, memory, memory_mask, frames) for layer in layers]

    def step(self, frame: int, query: Tensor, added: Tensor) -> Tensor:
        """Query (B, D) of frame number `frame`, counted from 0, to the decoder's output (B, D).

        `added` (B, D) is added to the input of every layer but the first.
        """
        first, *others = self._layers
        output = first.step(frame, query)
        for layer in others:
            output = layer.step(frame, output + added)
        return output


class _LayerState:
    def __init__(self, layer: nn.TransformerDecoderLayer, memory: Tensor, mask: Tensor, frames: int) -> None:
        if layer.norm_first:
            raise ValueError("IncrementalDecoder evaluates post-norm layers")
        self.layer = layer
        own, other, width = layer.self_attn, layer.multihead_attn, layer.linear1.in_features
        self.heads, rows = other.num_heads, len(memory)
        self.project = packed_linear(own.in_proj_weight, own.in_proj_bias, rows)
        self.merge = packed_linear(own.out_proj.weight, own.out_proj.bias, rows)
        self.project_query = packed_linear(other.in_proj_weight[:width], other.in_proj_bias[:width], rows)
        self.merge_memory = packed_linear(other.out_proj.weight, other.out_proj.bias, rows)
        self.widen = packed_linear(layer.linear1.weight, layer.linear1.bias, rows, layer.activation)
        self.narrow = packed_linear(layer.linear2.weight, layer.linear2.bias, rows)
        # Finite, so that a motion without any valid token gives numbers, which are then masked.
        hidden = torch.where(mask, 0.0, torch.finfo(memory.dtype).min).to(memory)
        self.hidden = hidden.repeat_interleave(self.heads, dim=0).unsqueeze(1)
        projected = F.linear(memory, other.in_proj_weight[width:], other.in_proj_bias[width:])
        # In one piece, or every step would copy them.
        self.memory_keys, self.memory_values = (
            part.unflatten(-1, (self.heads, -1)).transpose(1, 2).flatten(0, 1).contiguous()
            for part in projected.chunk(2, dim=-1)
        )
        self.keys = memory.new_zeros(rows * self.heads, frames, width // self.heads)
        self.values = torch.zeros_like(self.keys)
        self.visible = memory.new_zeros(1, 1, 1)

    def step(self, frame: int, x: Tensor) -> Tensor:
        layer, past = self.layer, slice(0, frame + 1)
        query, key, value = self.project(x).view(len(x), 3, self.heads, -1).unbind(1)
        self.keys[:, frame], self.values[:, frame] = key.flatten(0, 1), value.flatten(0, 1)
        attended = _attend(query, self.keys[:, past], self.values[:, past], self.visible)
        x = layer.norm1(x + self.merge(attended))
        query = self.project_query(x).view(len(x), self.heads, -1)
        attended = _attend(query, self.memory_keys, self.memory_values, self.hidden)
        x = layer.norm2(x + self.merge_memory(attended))
        return layer.norm3(x + self.narrow(self.widen(x)))


def _attend(query: Tensor, keys: Tensor, values: Tensor, hidden: Tensor) -> Tensor:
    """Attention of one query (B, H, W) to (B * H, L, W), with what is added to the scores: (B, H * W).

    Two products are faster than torch's function for many queries.
    """
    scores = torch.baddbmm(hidden, query.flatten(0, 1).unsqueeze(1), keys.mT, alpha=query.shape[-1] ** -0.5)
    return (scores.softmax(dim=-1) @ values).view(len(query), -1)
