from __future__ import annotations

import math

import torch

from motiongen.generation.positions import sinusoidal


def test_closed_form():
    code = sinusoidal(torch.tensor([0, 3]), 4)
    expected = [[0.0, 1.0, 0.0, 1.0], [math.sin(3), math.cos(3), math.sin(0.03), math.cos(0.03)]]
    torch.testing.assert_close(code, torch.tensor(expected))


def test_odd_width():
    assert sinusoidal(torch.arange(3), 5).shape == (3, 5)
