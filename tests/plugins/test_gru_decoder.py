from __future__ import annotations

import pytest
import torch
from torch import nn

from motiongen.contracts import CompositionError, Controls
from motiongen.generation.embeddings import Embeddings
from motiongen_plugins.gru_decoder.gru_decoder import GRUDecoder
from motiongen_plugins.latent_reinforcement.latent_reinforcement import LatentReinforcement
from tests.compositions import batch
from tests.plugins.um_cvae import DIMENSIONS

REINFORCED = {"latent_reinforcement": LatentReinforcement}


def decoder(layer_input, layers: int = 4, residual: float = 0.0) -> GRUDecoder:
    torch.manual_seed(0)
    return GRUDecoder(DIMENSIONS, Embeddings(DIMENSIONS), layer_input=layer_input, layers=layers, residual=residual)


def controls(frames: int = 7) -> Controls:
    generator = torch.Generator().manual_seed(1)
    queries = torch.randn(2, frames, DIMENSIONS.width, generator=generator)
    latent = torch.randn(2, DIMENSIONS.width, generator=generator)
    return Controls(queries, torch.full_like(queries, torch.nan), torch.ones(2, frames, dtype=torch.bool), latent)


def step(gru: nn.GRU, x: torch.Tensor, h: torch.Tensor) -> torch.Tensor:
    """One frame of a GRU layer (Cho et al. 2014, in torch's form with the reset gate behind the product)."""
    of_input = (gru.weight_ih_l0 @ x + gru.bias_ih_l0).chunk(3)
    of_state = (gru.weight_hh_l0 @ h + gru.bias_hh_l0).chunk(3)
    reset, update = (torch.sigmoid(i + s) for i, s in zip(of_input[:2], of_state[:2], strict=True))
    return (1 - update) * torch.tanh(of_input[2] + reset * of_state[2]) + update * h


@pytest.mark.parametrize("residual", [0.0, 1.0])
@pytest.mark.parametrize("reinforced", [True, False])
def test_equals_the_recurrence_by_hand(reinforced, residual):
    module, given = decoder(REINFORCED if reinforced else {}, residual=residual), controls()
    got = module.generate(given, batch((7, 7)).condition)
    for row in range(2):
        states = [torch.zeros(DIMENSIONS.width)] * 4
        for t in range(7):
            x = given.queries[row, t]
            for number, gru in enumerate(module.layers):
                got_by_layer = x + given.latent[row] if reinforced and number > 0 else x
                states[number] = step(gru, got_by_layer, states[number])
                x = residual * x + states[number]
            torch.testing.assert_close(got[row, t], module.pose(x), atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("reinforced", [True, False])
def test_training_and_use_give_the_same(reinforced):
    module, given, data = decoder(REINFORCED if reinforced else {}), controls(), batch((7, 7))
    assert torch.equal(module(given, data.condition, data.past), module.generate(given, data.condition))


def test_the_code_reaches_the_motion_past_constant_queries():
    module, given = decoder(REINFORCED), controls()
    other = Controls(given.queries, given.memory, given.mask, -given.latent)
    condition = batch((7, 7)).condition
    assert (module.generate(given, condition) - module.generate(other, condition)).abs().max() > 1e-2


def test_reinforcement_of_a_single_layer_is_refused():
    with pytest.raises(CompositionError, match="latent_reinforcement would have no effect"):
        decoder(REINFORCED, layers=1)
