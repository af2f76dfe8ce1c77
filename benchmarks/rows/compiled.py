"""torch.compile on one layer of ACTOR's encoder, forward and backward, without dropout as at `scale=small`.

Reference: the layer as it is. A layer's first call compiles it, which takes as long as `warm-up` says, for each kind of
layer and, unless shapes are taken as dynamic, for each length.
"""

from __future__ import annotations

import time
from functools import partial

import torch
from torch import Tensor, nn

from benchmarks.measuring import Effort, interleaved
from benchmarks.results import Comparison, Figure, Result, relative_error

TITLE = "torch.compile, one encoder layer, batch 20 x 62 tokens"


def gradient(layer: nn.Module, x: Tensor) -> Tensor:
    return torch.autograd.grad(layer(x).square().mean(), x)[0]


def measure(effort: Effort) -> list[Result]:
    torch.manual_seed(0)
    width = effort.size(256, 8)
    layer = nn.TransformerEncoderLayer(width, 4, 4 * width, 0.0, "gelu", batch_first=True)
    x = torch.randn(effort.size(20, 2), effort.size(62, 3), width, requires_grad=True)
    # Of the quick run only the capture: generating code takes longer than everything else there.
    compiled = torch.compile(layer, dynamic=True, backend="eager" if effort.quick else "inductor")
    start = time.perf_counter()
    error = relative_error(gradient(compiled, x), gradient(layer, x))
    warm_up = time.perf_counter() - start
    taken = interleaved({"reference": partial(gradient, layer, x), "ours": partial(gradient, compiled, x)}, effort)
    return [Comparison("float32", **taken, error=error, tolerance=1e-4), Figure("warm-up", warm_up, "s")]
