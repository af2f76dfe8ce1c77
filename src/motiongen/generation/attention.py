"""Transformer layers without the products that their result does not depend on."""

from __future__ import annotations

import torch.nn.functional as F
from torch import Tensor, nn


class DecoderLayer(nn.TransformerDecoderLayer):
    """As torch's; a memory of a single token takes no queries and no keys, since its weight is 1 whatever they are.

    Such a memory, which has to be valid, is ACTOR's code and that of MARIONET's Time Unrolling.
    """

    def _mha_block(
        self,
        x: Tensor,
        mem: Tensor,
        attn_mask: Tensor | None,
        key_padding_mask: Tensor | None,
        is_causal: bool = False,
    ) -> Tensor:
        if mem.shape[1] != 1:
            return super()._mha_block(x, mem, attn_mask, key_padding_mask, is_causal)
        # Without the zero, the norm before would have no gradient, which training on several devices asks for.
        return self.dropout2(attended_token(self.multihead_attn, mem, x.shape[1])) + 0 * x


def attended_token(attention: nn.MultiheadAttention, memory: Tensor, queries: int) -> Tensor:
    """What each of any `queries` queries gets from a memory (B, 1, D): (B, queries, D).

    In training every query loses a head with the layer's rate of dropout, as it does in torch's layer.
    """
    width, heads = attention.embed_dim, attention.num_heads
    value = F.linear(memory, attention.in_proj_weight[2 * width :], attention.in_proj_bias[2 * width :])
    of_heads = value.view(-1, heads, 1, width // heads)  # (B, H, 1, W)
    projection = attention.out_proj.weight.view(width, heads, -1).permute(1, 2, 0)  # (H, W, D)
    contributions = (of_heads @ projection).squeeze(2)  # (B, H, D)
    weights = F.dropout(value.new_ones(len(value), queries, heads), attention.dropout, attention.training)
    return weights @ contributions + attention.out_proj.bias


def first_outputs(layer: nn.TransformerEncoderLayer, tokens: Tensor, valid: Tensor, count: int) -> Tensor:
    """The first `count` outputs (B, count, D) of a layer for tokens (B, L, D) of which some are valid (B, L).

    They alone are queried, so that of the other tokens no more is computed than their keys and values.
    """
    x = layer.norm1(tokens) if layer.norm_first else tokens
    attended, _ = layer.self_attn(x[:, :count], x, x, key_padding_mask=~valid, need_weights=False)
    output = tokens[:, :count] + layer.dropout1(attended)
    if layer.norm_first:
        return output + layer._ff_block(layer.norm2(output))
    output = layer.norm1(output)
    return layer.norm2(output + layer._ff_block(output))
