from __future__ import annotations

import math

import pytest
import torch
from torch import nn

from motiongen.generation.dropout import QuickDropout, with_quick_dropout
from tests.compositions import marionet


@pytest.mark.parametrize("rate", [0.001, 0.1, 0.5, 0.9])
def test_each_place_is_dropped_as_often_as_asked_and_independently(rate: float) -> None:
    """Places modulo four share a draw: each of the four, and each pair of them, has the right frequency."""
    torch.manual_seed(0)
    count = 400_000
    dropped = (QuickDropout(rate)(torch.ones(4 * count)) == 0).view(count, 4).double()
    expected = {1: rate, 2: rate**2}
    pairs = (dropped[:, :-1] * dropped[:, 1:]).mean(dim=0)
    for found, order in [*((share, 1) for share in dropped.mean(dim=0)), *((share, 2) for share in pairs)]:
        error = math.sqrt(expected[order] * (1 - expected[order]) / count)
        assert found.item() == pytest.approx(expected[order], abs=5 * error + 2**-16)


def test_what_is_kept_is_scaled_so_that_the_mean_stays() -> None:
    torch.manual_seed(0)
    values = torch.randn(1001, 999, dtype=torch.float64)
    found = QuickDropout(0.25)(values)
    kept = found != 0
    torch.testing.assert_close(found[kept], values[kept] / 0.75)
    assert (found.sum() / values.abs().sum()).item() == pytest.approx(
        (values.sum() / values.abs().sum()).item(), abs=3e-3
    )


def test_gradients_pass_where_values_do() -> None:
    values = torch.randn(7, 5, requires_grad=True)
    torch.manual_seed(3)
    found = QuickDropout(0.5)(values)
    found.sum().backward()
    assert values.grad is not None
    assert torch.equal(values.grad, torch.where(found == 0, 0.0, 2.0))


def test_the_seed_decides_and_evaluation_changes_nothing() -> None:
    values, dropout = torch.randn(64, 3), QuickDropout(0.3)
    found = [(torch.manual_seed(seed), dropout(values))[1] for seed in (1, 1, 2)]
    assert torch.equal(found[0], found[1])
    assert not torch.equal(found[0], found[2])
    assert torch.equal(dropout.eval()(values), values)


@pytest.mark.parametrize("rate", [0.0, 1.0])
def test_nothing_and_everything_can_be_dropped(rate: float) -> None:
    values = torch.ones(9)
    assert torch.equal(QuickDropout(rate)(values), values * (1 - rate))


def test_every_dropout_of_a_generator_is_a_quick_one() -> None:
    kinds = {type(module) for module in marionet().modules() if isinstance(module, nn.Dropout)}
    assert kinds == {QuickDropout}


def test_the_rate_stays() -> None:
    layer = nn.TransformerEncoderLayer(8, 2, 16, dropout=0.3)
    with_quick_dropout(layer)
    assert [child.p for child in layer.modules() if isinstance(child, QuickDropout)] == [0.3] * 3
