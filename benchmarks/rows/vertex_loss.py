"""The vertex loss alone, forward and backward.

Reference: every vertex by blended 4 x 4 matrices, as smplx does it. Without correctives ours is a quadratic form in the
joints' transforms, exact for rigid skinning; with them it skins every vertex, column by column.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import torch
import torch.nn.functional as F
from torch import Tensor

from benchmarks.measuring import Effort, floor, interleaved, peak_mebibytes
from benchmarks.reference import kinematics
from benchmarks.results import Comparison, Figure, Result, relative_error
from benchmarks.subjects import SMPL_VERTICES, body, poses
from motiongen.motion.bodies import Body
from motiongen.objectives.vertices import Vertices

TITLE = "Vertex loss alone, 1,200 bodies of 6,890 vertices"
TARGETS = {False: 80.0, True: 6.0}
"""Whether correctives are kept, to the ratio that is aimed at."""


def plain_gradient(predicted: Tensor, target: Tensor, skinned: Body) -> Tensor:
    loss = F.mse_loss(kinematics.vertices(predicted, skinned), kinematics.vertices(target, skinned))
    return torch.autograd.grad(loss, predicted)[0]


def our_gradient(predicted: Tensor, target: Tensor, quantity: Vertices) -> Tensor:
    skeleton = quantity.body.skeleton
    loss = (quantity(predicted, skeleton) - quantity(target, skeleton)).square().mean()
    return torch.autograd.grad(loss, predicted)[0]


def ways(correctives: bool, effort: Effort) -> dict[str, Callable[[], Tensor]]:
    # Both on the body as the quantity sees it, fitted to its own skeleton.
    skinned = body(effort.size(SMPL_VERTICES, 50), correctives)
    skinned = skinned.fitted_to(skinned.skeleton)
    quantity = Vertices(body=skinned, correctives=correctives)
    count = effort.size(1200, 4)
    predicted, target = poses(count, seed=0).requires_grad_(), poses(count, seed=1)
    our_gradient(predicted[:2], target[:2], quantity)  # factors the Gram matrix, which is done once in a run
    return {
        "reference": partial(plain_gradient, predicted, target, skinned),
        "ours": partial(our_gradient, predicted, target, quantity),
    }


def one_way(way: str, correctives: bool, effort: Effort) -> Callable[[], Tensor]:
    """For a process of its own, whose memory is looked at."""
    return ways(correctives, effort)[way]


def measure(effort: Effort) -> list[Result]:
    found: list[Result] = []
    for correctives in (False, True):
        made = ways(correctives, effort)
        error = relative_error(made["ours"](), made["reference"]())
        name = "correctives kept" if correctives else "rigid skinning"
        found.append(
            Comparison(
                f"{name}, float32",
                **interleaved(made, effort),
                error=error,
                tolerance=1e-4,
                target=TARGETS[correctives],
                floor=floor(made["ours"], effort),
            )
        )
    for correctives in (False, True):
        for way in ("reference", "ours"):
            name = "correctives kept" if correctives else "rigid skinning"
            found.append(
                Figure(f"memory, {name}, {way}", peak_mebibytes(effort, one_way, way, correctives, effort), "MiB")
            )
    return found
