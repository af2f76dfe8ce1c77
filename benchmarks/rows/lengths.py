"""What MARIONET costs against the length of a motion, the batch and the joints of a body; no reference.

A slope of 1 means twice the size costs twice the time. Generation is of a whole motion, a training step of one pass
(teacher forcing), both at the paper's scale without padding. Of bodies with more joints than SMPL's 22 (SMPL-X has 55)
the loss is the pose's alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import torch
import torch.nn.functional as F
from torch import Tensor

from benchmarks.measuring import Effort, interleaved, slope
from benchmarks.results import Figure, Result
from benchmarks.rows.actor_training import our_loss, step
from benchmarks.subjects import body, composition, motion_batch
from motiongen.contracts import GeneratorModule, MotionBatch

TITLE = "Cost against length, batch and joints"


def measure(effort: Effort) -> list[Result]:
    generator, objective = composition("marionette", effort)
    optimizer = torch.optim.Adam(generator.parameters(), lr=1e-4)

    def generation(frames: int, batch: int) -> object:
        return generator.generate(motion_batch([frames] * batch).condition, 0)

    def training(frames: int, batch: int) -> None:
        step(partial(our_loss, generator, objective, motion_batch([frames] * batch), body(1), False), optimizer)

    found: list[Result] = []
    made = [4, 8] if effort.quick else [20, 200, 2000]
    # Dropout keeps the attention of every layer: 2,000 frames would take 8 GB.
    trained = [4, 8] if effort.quick else [20, 200, 1000]
    batches = [1, 2] if effort.quick else [1, 16, 256]
    for name, cost, lengths in (("generation", generation, made), ("training step", training, trained)):
        for what, sizes, call in (
            ("frames, batch 1", lengths, lambda size, cost=cost: cost(size, 1)),
            ("motions of 20 frames", batches, lambda size, cost=cost: cost(effort.size(20, 4), size)),
        ):
            found += _slopes(name, what, {size: partial(call, size) for size in sizes}, effort)
    for name, calls in _of_joints(effort).items():
        found += _slopes(name, "joints, batch 8 of 60 frames", calls, effort)
    return found


def _slopes(name: str, what: str, calls: dict[int, Callable[[], object]], effort: Effort) -> list[Figure]:
    taken = interleaved({str(size): call for size, call in calls.items()}, effort)
    sizes, medians = list(calls), [timing.median for timing in taken.values()]
    return [
        *(Figure(f"{name}, {size} {what}", taken[str(size)].median, "s") for size in sizes),
        Figure(f"{name}, slope over {what}", slope(sizes, medians)),
        Figure(f"{name}, slope over the last two: {what}", slope(sizes[-2:], medians[-2:])),
    ]


def _of_joints(effort: Effort) -> dict[str, dict[int, Callable[[], object]]]:
    generation: dict[int, Callable[[], object]] = {}
    training: dict[int, Callable[[], object]] = {}
    for joints in (22, 55, 110):
        features = 6 * joints + 3
        generator, _ = composition("marionette", effort, features)
        batch = motion_batch([effort.size(60, 4)] * effort.size(8, 2))
        draws = torch.Generator().manual_seed(0)
        initial = torch.randn(*batch.condition.initial_motion.shape[:2], features, generator=draws)
        motion = torch.randn(*batch.motion.shape[:2], features, generator=draws)
        batch = MotionBatch(motion, replace(batch.condition, initial_motion=initial))
        optimizer = torch.optim.Adam(generator.parameters(), lr=1e-4)
        generation[joints] = partial(generator.generate, batch.condition, 0)
        training[joints] = partial(step, partial(_pose_loss, generator, batch), optimizer)
    return {"generation": generation, "training step": training}


def _pose_loss(generator: GeneratorModule, batch: MotionBatch) -> Tensor:
    prediction = generator.reconstruct(batch, 0.0, torch.Generator().manual_seed(0))
    return F.mse_loss(prediction.motion, batch.motion)
