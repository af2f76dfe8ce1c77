"""Where the time of one training step and of one generation goes: the operators with the largest share of it.

Of the reference first, and of ours; both call some operators by different names.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import torch
from torch.profiler import ProfilerActivity, profile

from benchmarks.measuring import Effort
from benchmarks.reference.transformers import PlainMarionet
from benchmarks.results import Figure, Result
from benchmarks.rows import actor_training
from benchmarks.rows.actor_training import our_loss, step
from benchmarks.rows.marionet_training import plain_loss
from benchmarks.subjects import body, composition, motion_batch

TITLE = "Profiles"
SHOWN = 6


def measure(effort: Effort) -> list[Result]:
    generator, objective = composition("marionette", effort)
    optimizer = torch.optim.Adam(generator.parameters(), lr=1e-4)
    batch = motion_batch([effort.size(85, 5)] * effort.size(30, 2))
    one = motion_batch([effort.size(120, 6)]).condition
    noise = torch.randn(1, generator.dimensions.width, generator=torch.Generator().manual_seed(0))
    plain, resting = PlainMarionet(generator), PlainMarionet(generator).eval()
    plain_optimizer = torch.optim.Adam(plain.parameters(), lr=1e-4)
    calls: dict[str, Callable[[], object]] = {
        "MARIONET training, reference": partial(step, partial(plain_loss, plain, batch), plain_optimizer),
        "MARIONET training": partial(
            step, partial(our_loss, generator, objective, batch, body(1), False, 0.5), optimizer
        ),
        "MARIONET generation, batch 1, reference": partial(resting.generate, one, noise),
        "MARIONET generation, batch 1": partial(generator.generate, one, 0),
        "ACTOR training, vertex loss, reference": actor_training.one_step("reference", effort),
        "ACTOR training, vertex loss": actor_training.one_step("32", effort),
    }
    return [figure for name, call in calls.items() for figure in _shares(name, call)]


def _shares(name: str, call: Callable[[], object]) -> list[Figure]:
    call()
    with profile(activities=[ProfilerActivity.CPU]) as found:
        call()
    averages = sorted(found.key_averages(), key=lambda one: -one.self_cpu_time_total)
    total = sum(one.self_cpu_time_total for one in averages)
    return [Figure(f"{name}: {one.key}", 100 * one.self_cpu_time_total / total, "%") for one in averages[:SHOWN]]
