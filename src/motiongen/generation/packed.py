"""Linear layers for few rows on the CPU, where a general matrix product takes several times its floor."""

from __future__ import annotations

from collections.abc import Callable

import torch
import torch.nn.functional as F
from torch import Tensor

Map = Callable[[Tensor], Tensor]


def packed_linear(weight: Tensor, bias: Tensor, rows: int, activation: Map | None = None) -> Map:
    """A map of x (rows, in) to activation(x W^T + b) (rows, out), whose weight (out, in) is laid out once, for `rows`.

    oneDNN keeps the weight in blocks, as for compiled and frozen models, and applies the activation on the way out: for
    eight rows in a half to two thirds of the time of `F.linear`. A single row is faster without, and faster still by a
    weight that is stored input first, if the map widens.

    What it gives has no gradient. Where gradients are recorded, on other devices, in other precisions and for
    activations that oneDNN is not asked for, `F.linear` is used.
    """
    fused = _FUSED.get(activation)
    if rows > 1 and fused is not None and not torch.is_grad_enabled() and _packs(weight):
        operators, (name, algorithm) = torch.ops.mkldnn, fused
        blocks = operators._reorder_linear_weight(weight, rows)
        return lambda x: operators._linear_pointwise(x, blocks, bias, name, [], algorithm)
    widens = weight.shape[0] >= weight.shape[1]
    laid_out = weight.T.contiguous().T if rows == 1 and widens else weight
    if activation is None:
        return lambda x: F.linear(x, laid_out, bias)
    return lambda x: activation(F.linear(x, laid_out, bias))


_FUSED: dict[Map | None, tuple[str, str]] = {None: ("none", ""), F.relu: ("relu", ""), F.gelu: ("gelu", "none")}
"""Activations with oneDNN's name and algorithm; "none" of the GELU is the exact one, as `F.gelu`'s."""


def _packs(weight: Tensor) -> bool:
    plain = weight.device.type == "cpu" and weight.dtype == torch.float32 and not torch.is_autocast_enabled("cpu")
    return plain and torch.backends.mkldnn.is_available() and hasattr(torch.ops.mkldnn, "_reorder_linear_weight")
