"""How much of a training epoch is spent waiting for its batches.

MARIONET at the paper's scale, batch 30, built-in motion. Batches are made in the process that trains, when they are
asked for. How many motions a second come if nothing else is done is measured besides, with other processes that make
them, too.
"""

from __future__ import annotations

import tempfile
import time
from functools import partial
from itertools import islice

import torch
from hydra.utils import instantiate

from benchmarks.measuring import Effort
from benchmarks.results import Figure, Result
from benchmarks.rows.actor_training import our_loss, step
from benchmarks.subjects import body
from motiongen.configuration import compose
from motiongen.tasks.assembly import build_data, build_generator

TITLE = "Training input"


def measure(effort: Effort) -> list[Result]:
    with tempfile.TemporaryDirectory() as folder:
        scale = "smoke" if effort.quick else "paper"
        sessions = f"data.source.sessions={effort.size(36, 6)}"
        settings = [sessions, "data.source.subjects=3", "data.min_clips=2", "data.batch_size=30"]
        options = ["+experiment=marionette", f"scale={scale}", f"cache={folder}", *settings]
        config = compose(options)
        data = build_data(config)
        generator, objective = build_generator(config, data), instantiate(config.objective)
        optimizer = torch.optim.Adam(generator.parameters(), lr=1e-4)
        waiting = working = 0.0
        before = time.perf_counter()
        for batch in islice(data.train_batches(0), 1 if effort.quick else 4):
            ready = time.perf_counter()
            step(partial(our_loss, generator, objective, batch, body(1), False, 0.5), optimizer)
            done = time.perf_counter()
            waiting, working, before = waiting + ready - before, working + done - ready, done
        steps = 1 if effort.quick else 4
        return [
            Figure("share of the time spent waiting", 100 * waiting / (waiting + working), "%", "under 2 %"),
            Figure("a step", working / steps, "s"),
            *(_alone([*options, f"data.workers={workers}"], workers) for workers in (0, 1, 2)),
        ]


def _alone(options: list[str], workers: int) -> Figure:
    batches = build_data(compose(options)).train_batches(0)
    start = time.perf_counter()
    motions = sum(len(batch.motion) for batch in batches)
    return Figure(f"batches alone, data.workers={workers}", motions / (time.perf_counter() - start), "motions / s")
