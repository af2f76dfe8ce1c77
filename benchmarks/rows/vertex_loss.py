"""The vertex loss alone, forward and backward.

Reference: every vertex by blended 4 x 4 matrices, as smplx does it. Without correctives ours is a quadratic form in the
joints' transforms, exact for rigid skinning; with them it skins every vertex, a few at a time. The estimate adds to the
rigid error what correctives change in it on vertices drawn at random; its error is that of one draw. Compiled is
`objective.quantities.vertices.compiled=true`.
"""

from __future__ import annotations

import time
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
from motiongen.objectives.corrected_vertices import CorrectedVertices
from motiongen.objectives.vertices import Vertices

TITLE = "Vertex loss alone, 1,200 bodies of 6,890 vertices"
RIGID, COMPILED, KEPT, ESTIMATED = WAYS = (
    "rigid skinning",
    "rigid skinning, compiled",
    "correctives kept",
    "correctives estimated",
)
TARGETS = {RIGID: 80.0, COMPILED: 80.0, KEPT: 6.0, ESTIMATED: 25.0}
TOLERANCES = {RIGID: 1e-4, COMPILED: 1e-4, KEPT: 1e-4, ESTIMATED: 2e-2}
SAMPLED = 512


def plain_gradient(predicted: Tensor, target: Tensor, skinned: Body) -> Tensor:
    loss = F.mse_loss(kinematics.vertices(predicted, skinned), kinematics.vertices(target, skinned))
    return torch.autograd.grad(loss, predicted)[0]


def rigid_gradient(predicted: Tensor, target: Tensor, quantity: Vertices) -> Tensor:
    skeleton = quantity.body.skeleton
    loss = (quantity(predicted, skeleton) - quantity(target, skeleton)).square().mean()
    return torch.autograd.grad(loss, predicted)[0]


def corrected_gradient(predicted: Tensor, target: Tensor, distance: CorrectedVertices) -> Tensor:
    loss = distance(predicted, target, distance.body.skeleton).mean()
    return torch.autograd.grad(loss, predicted)[0]


def ways(name: str, effort: Effort) -> dict[str, Callable[[], Tensor]]:
    # Both on the body as the loss sees it, fitted to its own skeleton.
    skinned = body(effort.size(SMPL_VERTICES, 50), correctives=name in (KEPT, ESTIMATED))
    skinned = skinned.fitted_to(skinned.skeleton)
    count = effort.size(1200, 4)
    predicted, target = poses(count, seed=0).requires_grad_(), poses(count, seed=1)
    if name in (RIGID, COMPILED):
        ours = partial(rigid_gradient, quantity=Vertices(body=skinned, compiled=name == COMPILED))
    else:
        sampled = effort.size(SAMPLED, 45) if name == ESTIMATED else None
        draws = torch.Generator().manual_seed(0)
        ours = partial(corrected_gradient, distance=CorrectedVertices(body=skinned, sampled=sampled, draws=draws))
    ours(predicted[:2], target[:2])  # factors the Gram matrix and compiles, which is done once in a run
    return {"reference": partial(plain_gradient, predicted, target, skinned), "ours": partial(ours, predicted, target)}


def one_way(way: str, name: str, effort: Effort) -> Callable[[], Tensor]:
    """For a process of its own, whose memory is looked at."""
    return ways(name, effort)[way]


def measure(effort: Effort) -> list[Result]:
    found: list[Result] = []
    for name, target in TARGETS.items():
        start = time.perf_counter()
        made = ways(name, effort)
        if name == COMPILED:
            made["ours"]()
            compiling = Figure("compiling at the first two calls", time.perf_counter() - start, "s")
        found.append(
            Comparison(
                f"{name}, float32",
                error=relative_error(made["ours"](), made["reference"]()),
                **interleaved(made, effort),
                tolerance=TOLERANCES[name],
                target=target,
                floor=floor(ways(RIGID if name == COMPILED else name, effort)["ours"], effort),
            )
        )
    found.append(compiling)
    for name in WAYS:
        for way in ("reference", "ours"):
            found.append(Figure(f"memory, {name}, {way}", peak_mebibytes(effort, one_way, way, name, effort), "MiB"))
    return found
