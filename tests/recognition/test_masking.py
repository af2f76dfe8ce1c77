from __future__ import annotations

import pytest
import torch
from torch import nn

from motiongen.recognition.masking import MaskedBatchNorm, masked_mean

MASK = torch.arange(6) < torch.tensor([[6], [2], [0], [4]])


def frames(*shape: int, padding: float = 0.0) -> torch.Tensor:
    values = torch.randn(4, 6, *shape, generator=torch.Generator().manual_seed(0)) * 3 + 2
    values[~MASK] = padding
    return values


@pytest.mark.parametrize("padding", [0.0, 1e6, float("nan")])
def test_the_mean_is_that_of_the_valid_frames(padding: float) -> None:
    found = masked_mean(frames(5, padding=padding), MASK)
    for clip, length in enumerate((6, 2, 0, 4)):
        expected = frames(5)[clip, :length].mean(dim=0) if length else torch.zeros(5)
        torch.testing.assert_close(found[clip], expected)


@pytest.mark.parametrize("between", [(), (3,)])
@pytest.mark.parametrize("padding", [0.0, 1e6, float("nan")])
def test_the_norm_is_batch_norm_of_the_valid_frames_alone(between: tuple[int, ...], padding: float) -> None:
    masked, plain = MaskedBatchNorm(5), nn.BatchNorm1d(5)
    for training in (True, True, False):
        values = frames(*between, 5, padding=padding).requires_grad_()
        found = masked.train(training)(values, MASK)
        expected = plain.train(training)(frames(*between, 5)[MASK].reshape(-1, 5))
        torch.testing.assert_close(found[MASK].reshape(-1, 5), expected)
        assert (found[~MASK] == 0).all()
        found.square().sum().backward()
        assert values.grad is not None
        assert values.grad.isfinite().all()
        assert (values.grad[~MASK] == 0).all()
    torch.testing.assert_close(masked.norm.running_mean, plain.running_mean)
    torch.testing.assert_close(masked.norm.running_var, plain.running_var)
