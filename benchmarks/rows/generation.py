"""MARIONET generation, a batch of whole motions.

Reference: the decoder runs over all past frames at every step. Ours keeps the keys and values of past frames, projects
the controls once and lays the weights of the layers out once. The floor counts products alone. However small the
batch, the weights are read for every frame, too: below the table, the time of that at the rate of the machine.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

import torch
from torch import Tensor, nn

from benchmarks.measuring import Effort, floor, interleaved, reading_rate
from benchmarks.reference.transformers import PlainMarionet
from benchmarks.results import Comparison, Figure, Result, relative_error
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
    seconds = frames * weights_read(generator.decoder.transformer.layers) / reading_rate(effort.quick)
    return [*found, Figure("reading the layers' weights for every frame", 1e3 * seconds, "ms")]


def weights_read(layers: Iterable[nn.TransformerDecoderLayer]) -> int:
    """Bytes of the layers' parameters but those that give the memory's keys and values, which are projected once."""
    every = sum(parameter.nbytes for layer in layers for parameter in layer.parameters())
    once = sum(2 * layer.multihead_attn.embed_dim**2 * layer.linear1.weight.itemsize for layer in layers)
    return every - once
