"""MARIONET generation, a batch of whole motions.

Reference: the decoder runs over all past frames at every step. Ours keeps the keys and values of past frames and
projects the controls once. The floor counts no reading of weights, which is what bounds a batch of one.
"""

from __future__ import annotations

from functools import partial

import torch
from torch import Tensor

from benchmarks.measuring import Effort, floor, interleaved
from benchmarks.reference.transformers import PlainMarionet
from benchmarks.results import Comparison, Result, relative_error
from benchmarks.subjects import composition, motion_batch

TITLE = "MARIONET generation, 120 frames, 6 layers"
TARGETS = {1: (12.0, 600.0), 8: (20.0, 2500.0), 64: (35.0, 6000.0)}
"""Batch to the ratio and the frames a second that are aimed at."""


def measure(effort: Effort) -> list[Result]:
    generator, _ = composition("marionette", effort)
    generator.eval()
    plain = PlainMarionet(generator)
    frames = effort.size(120, 6)
    found: list[Result] = []
    for batch in (1, 2) if effort.quick else TARGETS:
        condition = motion_batch([frames] * batch).condition
        noise = torch.randn(batch, generator.dimensions.width, generator=torch.Generator().manual_seed(0))
        made: dict[str, Tensor] = {}

        def slow(condition=condition, noise=noise, made=made) -> None:
            made["reference"] = plain.generate(condition, noise)

        def fast(condition=condition, made=made) -> None:
            made["ours"] = generator.generate(condition, seed=0)

        taken = interleaved({"reference": slow, "ours": fast}, effort)
        target, rate = TARGETS.get(batch, (None, None))
        found.append(
            Comparison(
                f"batch {batch}",
                **taken,
                error=relative_error(made["ours"], made["reference"]),
                tolerance=1e-4,
                target=target,
                floor=floor(partial(generator.generate, condition, 0), effort),
                made=(batch * frames, "frames"),
                target_rate=rate,
            )
        )
    return found
