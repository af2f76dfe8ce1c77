"""Frame-by-frame evaluation of a causal Transformer decoder, with cached keys and values."""

from __future__ import annotations

from collections.abc import Iterable

import torch
import torch.nn.functional as F
from torch import Tensor, nn


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
        # Finite, so that a motion without any valid token gives numbers, which are then masked.
        hidden = torch.where(mask, 0.0, torch.finfo(memory.dtype).min)
        self.hidden = hidden.to(memory)[:, None, None, :]
        # In one piece, or every step would copy them.
        keys, values = _project(layer.multihead_attn, memory, 1, 3)
        self.memory_keys, self.memory_values = keys.contiguous(), values.contiguous()
        batch, heads, _, width = self.memory_keys.shape
        self.keys = memory.new_zeros(batch, heads, frames, width)
        self.values = memory.new_zeros(batch, heads, frames, width)

    def step(self, frame: int, x: Tensor) -> Tensor:
        layer = self.layer
        query, key, value = _project(layer.self_attn, x, 0, 3)
        self.keys[:, :, frame : frame + 1] = key
        self.values[:, :, frame : frame + 1] = value
        past = slice(0, frame + 1)
        attended = _attend(query, self.keys[:, :, past], self.values[:, :, past])
        x = layer.norm1(x + _merge(layer.self_attn, attended))
        (query,) = _project(layer.multihead_attn, x, 0, 1)
        attended = _attend(query, self.memory_keys, self.memory_values, self.hidden)
        x = layer.norm2(x + _merge(layer.multihead_attn, attended))
        return layer.norm3(x + layer.linear2(layer.activation(layer.linear1(x))))


def _project(attention: nn.MultiheadAttention, x: Tensor, first: int, last: int) -> list[Tensor]:
    """Projections [first, last) of x (B, L, D) out of 0 query, 1 key, 2 value, each as heads (B, H, L, D / H)."""
    rows = slice(first * attention.embed_dim, last * attention.embed_dim)
    projected = F.linear(x, attention.in_proj_weight[rows], attention.in_proj_bias[rows]).chunk(last - first, dim=-1)
    return [part.unflatten(-1, (attention.num_heads, -1)).transpose(1, 2) for part in projected]


def _attend(query: Tensor, keys: Tensor, values: Tensor, hidden: Tensor | float = 0.0) -> Tensor:
    """Attention of one query (B, H, 1, W) to (B, H, L, W); two products are faster than torch's function for many."""
    scores = (query * query.shape[-1] ** -0.5) @ keys.transpose(-1, -2)
    return (scores + hidden).softmax(dim=-1) @ values


def _merge(attention: nn.MultiheadAttention, heads: Tensor) -> Tensor:
    return attention.out_proj(heads.transpose(1, 2).flatten(-2))
