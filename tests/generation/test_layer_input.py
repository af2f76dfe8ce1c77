from __future__ import annotations

import pytest
import torch

from motiongen.contracts import CompositionError, Controls, Dimensions, LayerInput
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.layer_input import LayerInputs

DIMENSIONS = Dimensions(features=3, tags=2, initial_frames=1, width=4)
EMBEDDINGS = Embeddings(DIMENSIONS)


class Latent(LayerInput):
    def __init__(self, dimensions, embeddings):
        super().__init__()

    def forward(self, controls):
        return controls.latent.unsqueeze(1)


def controls() -> Controls:
    frames = torch.zeros(2, 5, 4)
    return Controls(frames, frames, torch.ones(2, 5, dtype=torch.bool), torch.randn(2, 4))


def test_mechanisms_are_summed():
    one = controls()
    both = LayerInputs(DIMENSIONS, EMBEDDINGS, {"first": Latent, "second": Latent}, layers=2)
    torch.testing.assert_close(both(one), 2 * one.latent.unsqueeze(1))


def test_nothing_is_added_without_a_mechanism():
    assert (LayerInputs(DIMENSIONS, EMBEDDINGS, {}, layers=1)(controls()) == 0).all()


def test_a_single_layer_is_refused():
    with pytest.raises(CompositionError, match=r"latent would have no effect.*layers=2 or more"):
        LayerInputs(DIMENSIONS, EMBEDDINGS, {"latent": Latent}, layers=1)
