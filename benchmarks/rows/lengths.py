"""What MARIONET costs against the length of a motion and against the batch; no reference.

A slope of 1 means twice the size costs twice the time. Generation is of a whole motion, a training step of one pass
(teacher forcing), both at the paper's scale without padding.
"""

from __future__ import annotations

from functools import partial

import torch

from benchmarks.measuring import Effort, interleaved, slope
from benchmarks.results import Figure, Result
from benchmarks.rows.actor_training import our_loss, step
from benchmarks.subjects import body, composition, motion_batch

TITLE = "Cost against length and batch"


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
            taken = interleaved({str(size): partial(call, size) for size in sizes}, effort)
            medians = [timing.median for timing in taken.values()]
            found += [Figure(f"{name}, {size} {what}", taken[str(size)].median, "s") for size in sizes]
            found.append(Figure(f"{name}, slope over {what}", slope(sizes, medians)))
            found.append(
                Figure(f"{name}, slope over the last two: {what}", slope(sizes[-2:], medians[-2:])),
            )
    return found
