"""What is left out of Transformer layers changes neither their outputs nor their gradients."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor, nn

from motiongen.generation.attention import DecoderLayer, attended_token, first_outputs

SIZES = {"d_model": 16, "nhead": 4, "dim_feedforward": 32, "batch_first": True, "dtype": torch.float64}
LENGTHS = torch.tensor([7, 4, 1])


def gradients(layer: nn.Module, output: Tensor, *inputs: Tensor) -> list[Tensor]:
    weights = torch.linspace(-1.0, 1.0, output.numel(), dtype=output.dtype).view_as(output)
    return list(torch.autograd.grad((output * weights).sum(), [*layer.parameters(), *inputs]))


@pytest.mark.parametrize("norm_first", [False, True])
@pytest.mark.parametrize("tokens", [1, 5])
def test_a_decoder_layer_is_that_of_torch(tokens: int, norm_first: bool) -> None:
    torch.manual_seed(0)
    plain = nn.TransformerDecoderLayer(dropout=0.0, norm_first=norm_first, **SIZES)
    ours = DecoderLayer(dropout=0.0, norm_first=norm_first, **SIZES)
    for parameter in plain.parameters():
        nn.init.normal_(parameter)
    ours.load_state_dict(plain.state_dict())
    x = torch.randn(3, 7, 16, dtype=torch.float64, requires_grad=True)
    memory = torch.randn(3, tokens, 16, dtype=torch.float64, requires_grad=True)
    padding = torch.arange(7) >= LENGTHS.unsqueeze(1)
    results = [layer(x, memory, tgt_key_padding_mask=padding) for layer in (plain, ours)]
    torch.testing.assert_close(results[1], results[0])
    expected = gradients(plain, results[0], x, memory)
    torch.testing.assert_close(gradients(ours, results[1], x, memory), expected)


@pytest.mark.parametrize("norm_first", [False, True])
def test_the_first_outputs_of_an_encoder_layer_are_those_of_torch(norm_first: bool) -> None:
    torch.manual_seed(0)
    layer = nn.TransformerEncoderLayer(dropout=0.0, norm_first=norm_first, **SIZES)
    tokens = torch.randn(3, 7, 16, dtype=torch.float64, requires_grad=True)
    valid = torch.arange(7) < LENGTHS.unsqueeze(1)
    whole = layer(tokens, src_key_padding_mask=~valid)[:, :2]
    ours = first_outputs(layer, tokens, valid, 2)
    torch.testing.assert_close(ours, whole)
    torch.testing.assert_close(gradients(layer, ours, tokens), gradients(layer, whole, tokens))


def test_queries_lose_heads_as_often_as_in_torch() -> None:
    """Mean and covariance over queries, which draw apart."""
    torch.manual_seed(0)
    attention = nn.MultiheadAttention(16, 4, dropout=0.3, batch_first=True, dtype=torch.float64)
    nn.init.normal_(attention.in_proj_bias)
    memory = torch.randn(1, 1, 16, dtype=torch.float64)
    queries = torch.randn(1, 20_000, 16, dtype=torch.float64)
    with torch.no_grad():
        plain = attention(queries, memory, memory, need_weights=False)[0][0]
        ours = attended_token(attention, memory, 20_000)[0]
    spread = plain.std(dim=0)
    assert ((ours.mean(0) - plain.mean(0)).abs() < 5 * spread * (2 / 20_000) ** 0.5).all()
    torch.testing.assert_close(ours.T.cov(), plain.T.cov(), rtol=0.1, atol=0.02 * float(spread.max()) ** 2)
    assert len(ours.round(decimals=9).unique(dim=0)) == 2**4
