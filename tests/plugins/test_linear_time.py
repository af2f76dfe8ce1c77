from __future__ import annotations

import torch

from motiongen.contracts import Code
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.positions import sinusoidal
from motiongen_plugins.linear_time.linear_time import LinearTime
from tests.compositions import batch
from tests.plugins.um_cvae import DIMENSIONS

WIDTH = DIMENSIONS.width


def unrolled(frames: int):
    torch.manual_seed(0)
    unroller = LinearTime(DIMENSIONS, Embeddings(DIMENSIONS))
    code = Code(latent=torch.randn(2, WIDTH), modulated=torch.randn(2, WIDTH))
    return unroller, code, unroller(code, batch((frames, 3)).condition)


def test_every_frame_is_a_linear_map_of_code_and_time():
    unroller, code, controls = unrolled(9)
    for_code, for_time = unroller.projection.weight.split(WIDTH, dim=1)
    for t in range(9):
        time = for_time @ sinusoidal(torch.tensor(t), WIDTH) + unroller.projection.bias
        torch.testing.assert_close(controls.queries[:, t], code.modulated @ for_code.T + time, atol=1e-5, rtol=1e-5)
    assert torch.equal(controls.queries, controls.memory)
    assert torch.equal(controls.latent, code.latent)


def test_more_frames_go_on_where_fewer_end():
    torch.testing.assert_close(unrolled(20)[2].queries[:, :9], unrolled(9)[2].queries)
