from __future__ import annotations

import torch
from torch import nn

from motiongen.generation.temporal_convolution import MaskedInstanceNorm, TemporalConvolution, dilation_of


def padded(lengths: tuple[int, ...], frames: int, channels: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Random frames, with large numbers where they are not valid."""
    values = 3 + 2 * torch.randn(len(lengths), frames, channels, generator=torch.Generator().manual_seed(0))
    mask = torch.arange(frames) < torch.tensor(lengths).unsqueeze(1)
    return values + 1e3 * ~mask.unsqueeze(-1), mask


def test_dilations_repeat():
    assert [dilation_of(layer) for layer in range(6)] == [1, 2, 4, 1, 2, 4]


def test_convolution_sees_zeros_outside_the_valid_frames():
    torch.manual_seed(0)
    layer = TemporalConvolution(4, 5, kernel=3, dilation=2)
    frames, mask = padded((9, 1, 6), 12, 4)
    got = layer(frames, mask)
    weight, bias = layer.convolution.weight, layer.convolution.bias
    for row, length in enumerate((9, 1, 6)):
        for t in range(length):
            taps = [(k, t + 2 * (k - 1)) for k in range(3) if 0 <= t + 2 * (k - 1) < length]
            expected = bias + sum(weight[:, :, k] @ frames[row, source] for k, source in taps)
            torch.testing.assert_close(got[row, t], expected.clamp(min=0), atol=1e-5, rtol=1e-5)


def test_norm_counts_valid_frames_alone():
    frames, mask = padded((9, 2, 6), 12, 4)
    got = MaskedInstanceNorm()(frames, mask)
    for row, length in enumerate((9, 2, 6)):
        expected = nn.InstanceNorm1d(4)(frames[row : row + 1, :length].transpose(1, 2)).transpose(1, 2)
        torch.testing.assert_close(got[row, :length], expected[0], atol=1e-5, rtol=1e-5)


def test_norm_of_a_single_frame_is_zero():
    frames, mask = padded((1,), 3, 4)
    assert (MaskedInstanceNorm()(frames, mask)[0, 0] == 0).all()
