"""One training step of ACTOR: forward, backward, AdamW.

Reference: time first, and the vertices of prediction and target skinned one by one. Ours takes the vertices' error as a
quadratic form in the joints' transforms. Dropout is on in what is timed and off where both losses are compared.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import torch
import torch.nn.functional as F
from torch import Tensor

from benchmarks.measuring import Effort, floor, interleaved, peak_mebibytes
from benchmarks.reference import kinematics
from benchmarks.reference.transformers import PlainActor
from benchmarks.results import Comparison, Figure, Result, relative_error
from benchmarks.subjects import SMPL_VERTICES, body, composition, motion_batch
from motiongen.contracts import GeneratorModule, MotionBatch
from motiongen.motion.bodies import Body
from motiongen.objectives.objective import Objective
from motiongen.objectives.quantities import pose
from motiongen.objectives.vertices import Vertices

TITLE = "ACTOR training step, batch 20 x 60 frames, 8 layers, 22 joints"
KL = 2e-4
TARGETS = {(True, "32"): 8.0, (True, "bf16"): 12.0, (False, "32"): 2.2, (False, "bf16"): 3.5}
"""Whether there is a vertex loss, and the precision, to the ratio that is aimed at."""
PRECISIONS = {"32": ("float32", torch.float32, 1e-4), "bf16": ("bfloat16", torch.bfloat16, 3e-2)}
"""Name, type of the matrix products, and how far the loss may be from the reference's in float32."""


def plain_loss(model: PlainActor, batch: MotionBatch, noise: Tensor, skinned: Body | None) -> Tensor:
    """As the published code has it."""
    motion, mean, spread = model(batch, noise)
    mask = batch.condition.mask
    loss = F.mse_loss(motion[mask], batch.motion[mask])
    if skinned is not None:
        made, wanted = kinematics.vertices(motion[mask], skinned), kinematics.vertices(batch.motion[mask], skinned)
        loss = loss + F.mse_loss(made, wanted)
    kl = -0.5 * torch.sum(1 + spread - mean.pow(2) - spread.exp())
    return loss + KL / len(mean) * kl


def our_loss(
    generator: GeneratorModule,
    objective: Objective,
    batch: MotionBatch,
    skinned: Body,
    autocast: bool,
    progress: float = 0.0,
) -> Tensor:
    """As the training shell has it."""
    with torch.autocast("cpu", torch.bfloat16, enabled=autocast):
        prediction = generator.reconstruct(batch, progress, torch.Generator().manual_seed(0))
        return objective.total(objective.terms(prediction, batch, skinned.skeleton), progress)


def step(loss: Callable[[], Tensor], optimizer: torch.optim.Optimizer) -> None:
    optimizer.zero_grad()
    loss().backward()
    optimizer.step()


Losses = dict[str, Callable[[], Tensor]]


def losses(vertices: bool, effort: Effort) -> tuple[PlainActor, GeneratorModule, Losses]:
    """Both models, of the same weights and without dropout, and the loss of each way."""
    generator, _ = composition("actor", effort)
    skinned = body(effort.size(SMPL_VERTICES, 50))
    batch = motion_batch([effort.size(60, 5)] * effort.size(20, 3))
    quantities = {"pose": pose} | ({"vertices": Vertices(body=skinned)} if vertices else {})
    weights = {**dict.fromkeys(quantities, 1.0), "kl": KL}
    objective = Objective(quantities=quantities, weights=weights, velocity=0.0, first_pass=0.1, last_pass=0.9)
    noise = torch.randn(len(batch.motion), generator.dimensions.width, generator=torch.Generator().manual_seed(0))
    model = PlainActor(generator.eval())
    found: Losses = {"reference": partial(plain_loss, model, batch, noise, skinned if vertices else None)}
    for name in PRECISIONS:
        found[name] = partial(our_loss, generator, objective, batch, skinned, name == "bf16")
    return model, generator, found


def steps(model: PlainActor, generator: GeneratorModule, found: Losses) -> dict[str, Callable[[], None]]:
    """A training step of each way, with dropout."""
    plain_optimizer = torch.optim.AdamW(model.train().parameters(), lr=1e-4)
    optimizer = torch.optim.AdamW(generator.train().parameters(), lr=1e-4)
    return {
        name: partial(step, loss, plain_optimizer if name == "reference" else optimizer) for name, loss in found.items()
    }


def one_step(way: str, effort: Effort) -> Callable[[], None]:
    """For a process of its own, whose memory is looked at; nothing ran in it before."""
    return steps(*losses(True, effort))[way]


def measure(effort: Effort) -> list[Result]:
    found: list[Result] = []
    for vertices in (True, False):
        model, generator, found_losses = losses(vertices, effort)
        expected = found_losses["reference"]()
        errors = {precision: relative_error(found_losses[precision](), expected) for precision in PRECISIONS}
        calls = steps(model, generator, found_losses)
        taken = interleaved(calls, effort)
        for precision, (name, dtype, tolerance) in PRECISIONS.items():
            found.append(
                Comparison(
                    f"{'with' if vertices else 'without'} vertex loss, {name}",
                    taken["reference"],
                    taken[precision],
                    error=errors[precision],
                    tolerance=tolerance,
                    target=TARGETS[vertices, precision],
                    floor=floor(calls[precision], effort, dtype),
                )
            )
    for way, name in (("reference", "reference"), ("32", "ours, float32")):
        found.append(
            Figure(f"memory of a step with vertex loss, {name}", peak_mebibytes(effort, one_step, way, effort), "MiB")
        )
    return found
