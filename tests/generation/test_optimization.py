from __future__ import annotations

from functools import partial

import pytest
import torch

from motiongen.generation.optimization import Optimization


@pytest.mark.parametrize(("final", "expected"), [(1.0, [1.0, 1.0, 1.0]), (0.1, [1.0, 0.55, 0.1])])
def test_rate_at_start_middle_and_end(final, expected):
    optimization = Optimization(optimizer=partial(torch.optim.Adam, lr=1e-3), final_rate=final)
    assert [optimization.factor(progress) for progress in (0.0, 0.5, 1.0)] == pytest.approx(expected)


def test_warmup_rises_linearly_to_the_cosine():
    adam = partial(torch.optim.Adam, lr=1e-3)
    risen, plain = (
        Optimization(optimizer=adam, final_rate=0.1, warmup=0.2),
        Optimization(optimizer=adam, final_rate=0.1),
    )
    shares = [risen.factor(progress) / plain.factor(progress) for progress in (0.0, 0.05, 0.1, 0.2, 0.6, 1.0)]
    assert shares == pytest.approx([0.0, 0.25, 0.5, 1.0, 1.0, 1.0])
