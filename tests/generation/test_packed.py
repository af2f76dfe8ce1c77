from __future__ import annotations

import pytest
import torch
import torch.nn.functional as F

from motiongen.generation.packed import packed_linear


@pytest.mark.parametrize("rows", [1, 2, 8, 64])
@pytest.mark.parametrize("activation", [None, F.relu, F.gelu, torch.tanh])
@pytest.mark.parametrize(("inputs", "outputs"), [(32, 96), (48, 48), (128, 33)])
def test_it_is_the_linear_layer_and_its_activation(rows, activation, inputs, outputs):
    drawn = torch.Generator().manual_seed(0)
    weight, bias, x = (
        torch.randn(*shape, generator=drawn) for shape in ((outputs, inputs), (outputs,), (rows, inputs))
    )
    expected = x.double() @ weight.double().T + bias.double()
    if activation is not None:
        expected = activation(expected)
    with torch.inference_mode():
        made = packed_linear(weight, bias, rows, activation)(x)
    torch.testing.assert_close(made.double(), expected, atol=3e-5, rtol=3e-6)


@pytest.mark.parametrize("rows", [1, 4])
def test_gradients_are_those_of_the_layer_where_they_are_recorded(rows):
    layer = torch.nn.Linear(6, 5)
    x = torch.randn(rows, 6)
    packed_linear(layer.weight, layer.bias, rows, F.gelu)(x).square().sum().backward()
    found = [parameter.grad for parameter in layer.parameters()]
    layer.zero_grad()
    F.gelu(layer(x)).square().sum().backward()
    for gradient, parameter in zip(found, layer.parameters(), strict=True):
        torch.testing.assert_close(gradient, parameter.grad)


def test_other_precisions_stay_what_they_are():
    weight, bias, x = torch.randn(5, 6).double(), torch.randn(5).double(), torch.randn(4, 6).double()
    with torch.inference_mode():
        assert packed_linear(weight, bias, 4)(x).dtype == torch.float64
        with torch.autocast("cpu", torch.bfloat16):
            assert packed_linear(weight.float(), bias.float(), 4)(x.float()).dtype == torch.bfloat16
