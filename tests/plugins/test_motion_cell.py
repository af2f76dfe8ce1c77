from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import nn

from motiongen_plugins.motion_cell.motion_cell import LEAST_DEVIATION, MotionCell

WORD, ATTRIBUTES, LATENT, FEATURES, HIDDEN, STATE, BATCH = 10, 4, 6, 7, 12, 9, 3


def cell() -> MotionCell:
    torch.manual_seed(0)
    return MotionCell(WORD, ATTRIBUTES, nn.ELU(), latent=LATENT, features=FEATURES, hidden=HIDDEN, state=STATE)


def inputs() -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(1)
    widths = (WORD, ATTRIBUTES, 2 * STATE)
    return tuple(torch.randn(BATCH, width, generator=generator) for width in widths)


def mlp(network: nn.Module, *parts: torch.Tensor) -> torch.Tensor:
    """Fully connected layers with ELU between them, from the weights alone; no activation after the last."""
    weights = list(network.parameters())
    x = torch.cat(parts, dim=-1)
    for index, (weight, bias) in enumerate(zip(weights[::2], weights[1::2], strict=True)):
        x = x @ weight.T + bias
        if index < len(weights) // 2 - 1:
            x = torch.where(x > 0, x, x.exp() - 1)
    return x


def elu(x: torch.Tensor) -> torch.Tensor:
    return torch.where(x > 0, x, x.exp() - 1)


def gru(unit: nn.GRUCell, x: torch.Tensor, h: torch.Tensor) -> torch.Tensor:
    """Cho et al. 2014, in torch's order of the gates: reset, update, new."""
    reset_x, update_x, new_x = (x @ unit.weight_ih.T + unit.bias_ih).chunk(3, dim=1)
    reset_h, update_h, new_h = (h @ unit.weight_hh.T + unit.bias_hh).chunk(3, dim=1)
    reset, update = torch.sigmoid(reset_x + reset_h), torch.sigmoid(update_x + update_h)
    return (1 - update) * torch.tanh(new_x + reset * new_h) + update * h


def gaussian(network: nn.Module, *parts: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Mean and deviation."""
    return mlp(network.mean, *parts), F.softplus(mlp(network.deviation, *parts)) + LEAST_DEVIATION


def step(unit: MotionCell, code: torch.Tensor, seen: torch.Tensor, state: torch.Tensor) -> torch.Tensor:
    low = gru(unit.lower, torch.cat([seen, code], dim=1), state[:, :STATE])
    return torch.cat([low, gru(unit.upper, low, state[:, STATE:])], dim=1)


def test_algorithm_1():
    unit = cell()
    word, attributes, state = inputs()
    keep = torch.zeros(BATCH, 1, dtype=torch.bool)
    with torch.no_grad():
        made, posterior = unit(word, attributes, state, keep, torch.Generator().manual_seed(2))
        seen = elu(mlp(unit.read_word, word))
        mean, deviation = gaussian(unit.posterior, seen, state, attributes)
        latent = mean + deviation * torch.randn(BATCH, LATENT, generator=torch.Generator().manual_seed(2))
        code = elu(mlp(unit.read_latent, latent))
        torch.testing.assert_close(posterior.mean, mean, atol=1e-5, rtol=1e-5)
        torch.testing.assert_close((0.5 * posterior.log_variance).exp(), deviation, atol=1e-5, rtol=1e-5)
        torch.testing.assert_close(made.word, elu(mlp(unit.write_word, code, state, attributes)), atol=1e-5, rtol=1e-5)
        torch.testing.assert_close(made.state, step(unit, code, seen, state), atol=1e-5, rtol=1e-5)


def test_algorithm_2():
    unit = cell()
    _, attributes, state = inputs()
    with torch.no_grad():
        made = unit.sample(attributes, state, torch.Generator().manual_seed(2))
        mean, deviation = gaussian(unit.prior, state, attributes)
        latent = mean + deviation * torch.randn(BATCH, LATENT, generator=torch.Generator().manual_seed(2))
        code = elu(mlp(unit.read_latent, latent))
        word = elu(mlp(unit.write_word, code, state, attributes))
        torch.testing.assert_close(made.word, word, atol=1e-5, rtol=1e-5)
        expected = step(unit, code, elu(mlp(unit.read_word, word)), state)
        torch.testing.assert_close(made.state, expected, atol=1e-5, rtol=1e-5)


def test_a_dropped_word_gives_way_to_the_cells_own_in_the_transition_alone():
    unit = cell()
    word, attributes, state = inputs()
    dropped = torch.tensor([[True], [False], [True]])
    none = torch.zeros_like(dropped)
    with torch.no_grad():
        kept, posterior = unit(word, attributes, state, none, torch.Generator().manual_seed(2))
        mixed, same = unit(word, attributes, state, dropped, torch.Generator().manual_seed(2))
        own, _ = unit(kept.word, attributes, state, none, torch.Generator().manual_seed(2))
    assert torch.equal(posterior.mean, same.mean)
    assert torch.equal(kept.word, mixed.word)
    torch.testing.assert_close(mixed.state[1], kept.state[1])
    assert (mixed.state[0] - kept.state[0]).abs().max() > 1e-4
    assert own.state.shape == (BATCH, 2 * STATE)


def test_sizes_of_table_1():
    unit = MotionCell(96, 8, nn.ELU(), latent=96, features=96, hidden=128, state=512)
    assert unit.state_width == 1024
    shapes = {name: tuple(p.shape) for name, p in unit.named_parameters() if name.endswith("weight")}
    deviation = [shape for name, shape in shapes.items() if name.startswith("prior.deviation")]
    assert deviation == [(128, 1032), (128, 128), (128, 128), (128, 128), (96, 128)]
    mean = [shape for name, shape in shapes.items() if name.startswith("posterior.mean")]
    assert mean == [(128, 1128), (128, 128), (128, 128), (128, 128), (96, 128)]
    read = [shape for name, shape in shapes.items() if name.startswith("read_word")]
    assert read == [(128, 96), (128, 128), (96, 128)]
    assert unit.lower.input_size == 192
    assert unit.upper.input_size == 512
