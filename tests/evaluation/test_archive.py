from __future__ import annotations

import torch

from motiongen.evaluation.archive import generator_fingerprint
from tests.compositions import marionet


def test_weights_and_settings_decide_the_fingerprint() -> None:
    generator = marionet()
    first = generator_fingerprint(generator, {"residual": 0.0})
    assert first == generator_fingerprint(generator, {"residual": 0.0})
    assert first != generator_fingerprint(generator, {"residual": 1.0})
    with torch.no_grad():
        next(generator.parameters()).view(-1)[0] += 1e-3
    assert first != generator_fingerprint(generator, {"residual": 0.0})
