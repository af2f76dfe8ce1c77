"""Frame-by-frame evaluation of a causal Transformer decoder, with cached keys and values."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

import torch
import torch.nn.functional as F
from torch import Tensor, nn

FEW_ROWS = 2
"""On the CPU, products of so few rows with a widening matrix take half the time if it is stored input first."""


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
        output = first.step(frame, query.unsqueeze(1))
        for layer in others:
            output = layer.step(frame, output + added.unsqueeze(1))
        return output.squeeze(1)


class _LayerState:
    def __init__(self, layer: nn.TransformerDecoderLayer, memory: Tensor, mask: Tensor, frames: int) -> None:
        if layer.norm_first:
            raise ValueError("IncrementalDecoder evaluates post-norm layers")
        self.layer = layer
        own, other, width = layer.self_attn, layer.multihead_attn, layer.linear1.in_features
        self.heads = other.num_heads
        few = memory.device.type == "cpu" and len(memory) <= FEW_ROWS
        self.project = _linear(own.in_proj_weight, own.in_proj_bias, input_first=few)
        self.project_query = _linear(other.in_proj_weight[:width], other.in_proj_bias[:width])
        self.widen = _linear(layer.linear1.weight, layer.linear1.bias, input_first=few)
        # Finite, so that a motion without any valid token gives numbers, which are then masked.
        hidden = torch.where(mask, 0.0, torch.finfo(memory.dtype).min)
        self.hidden = hidden.to(memory)[:, None, None, :]
        projected = F.linear(memory, other.in_proj_weight[width:], other.in_proj_bias[width:])
        # In one piece, or every step would copy them.
        self.memory_keys, self.memory_values = (part.contiguous() for part in _split(projected, 2, self.heads))
        self.keys = memory.new_zeros(len(memory), self.heads, frames, width // self.heads)
        self.values = torch.zeros_like(self.keys)

    def step(self, frame: int, x: Tensor) -> Tensor:
        layer = self.layer
        query, key, value = _split(self.project(x), 3, self.heads)
        self.keys[:, :, frame : frame + 1] = key
        self.values[:, :, frame : frame + 1] = value
        past = slice(0, frame + 1)
        attended = _attend(query, self.keys[:, :, past], self.values[:, :, past])
        x = layer.norm1(x + _merge(layer.self_attn, attended))
        (query,) = _split(self.project_query(x), 1, self.heads)
        attended = _attend(query, self.memory_keys, self.memory_values, self.hidden)
        x = layer.norm2(x + _merge(layer.multihead_attn, attended))
        return layer.norm3(x + layer.linear2(layer.activation(self.widen(x))))


def _linear(weight: Tensor, bias: Tensor, input_first: bool = False) -> Callable[[Tensor], Tensor]:
    return partial(F.linear, weight=weight.T.contiguous().T if input_first else weight, bias=bias)


def _split(projected: Tensor, count: int, heads: int) -> list[Tensor]:
    """Projections side by side (B, L, count * D), each as heads (B, H, L, D / H)."""
    return [part.unflatten(-1, (heads, -1)).transpose(1, 2) for part in projected.chunk(count, dim=-1)]


def _attend(query: Tensor, keys: Tensor, values: Tensor, hidden: Tensor | float = 0.0) -> Tensor:
    """Attention of one query (B, H, 1, W) to (B, H, L, W); two products are faster than torch's function for many."""
    scores = (query * query.shape[-1] ** -0.5) @ keys.transpose(-1, -2)
    return (scores + hidden).softmax(dim=-1) @ values


def _merge(attention: nn.MultiheadAttention, heads: Tensor) -> Tensor:
    return attention.out_proj(heads.transpose(1, 2).flatten(-2))
