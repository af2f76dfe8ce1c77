from __future__ import annotations

import pytest
import torch
from torch import nn

from motiongen.generation.incremental import IncrementalDecoder


@pytest.mark.parametrize("batch", [1, 3])
def test_steps_equal_the_causal_decoder(batch: int):
    torch.manual_seed(0)
    layer = nn.TransformerDecoderLayer(16, 4, 32, dropout=0.0, activation="gelu", batch_first=True)
    decoder = nn.TransformerDecoder(layer, 3).eval()
    for parameter in decoder.parameters():
        nn.init.normal_(parameter, std=0.3)
    query, memory, added = torch.randn(batch, 7, 16), torch.randn(batch, 5, 16), torch.randn(batch, 7, 16)
    mask = torch.arange(5) < torch.tensor([3, 5, 4])[:batch, None]
    future = torch.ones(7, 7, dtype=torch.bool).triu(1)
    with torch.no_grad():
        whole = query
        for index, layer in enumerate(decoder.layers):
            layer_input = whole + added if index else whole
            whole = layer(layer_input, memory, tgt_mask=future, memory_key_padding_mask=~mask)
        steps = IncrementalDecoder(decoder.layers, memory, mask, frames=7)
        stepped = torch.stack([steps.step(frame, query[:, frame], added[:, frame]) for frame in range(7)], dim=1)
    torch.testing.assert_close(stepped, whole, atol=1e-5, rtol=1e-5)


def test_pre_norm_layers_are_refused():
    layer = nn.TransformerDecoderLayer(16, 4, 32, batch_first=True, norm_first=True)
    with pytest.raises(ValueError, match="post-norm"):
        IncrementalDecoder([layer], torch.zeros(1, 1, 16), torch.ones(1, 1, dtype=torch.bool), frames=1)


def test_a_motion_without_any_valid_token_gives_numbers():
    torch.manual_seed(0)
    layer = nn.TransformerDecoderLayer(16, 4, 32, dropout=0.0, batch_first=True).eval()
    mask = torch.tensor([[True, True], [False, False]])
    with torch.inference_mode():
        steps = IncrementalDecoder([layer], torch.randn(2, 2, 16), mask, frames=1)
        assert steps.step(0, torch.randn(2, 16), torch.zeros(2, 16)).isfinite().all()
