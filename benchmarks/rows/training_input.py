"""How much of a training epoch is spent waiting for its batches.

MARIONET at the paper's scale, batch 30, built-in motion. Batches are made in the process that trains, when they are
asked for.
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
        settings = ["data.source.sessions=6", "data.source.subjects=3", "data.min_clips=2", "data.batch_size=30"]
        config = compose(["+experiment=marionette", f"scale={scale}", f"cache={folder}", *settings])
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
        return [
            Figure("share of the time spent waiting", 100 * waiting / (waiting + working), "%", "under 2 %"),
            Figure("a step", working / (1 if effort.quick else 4), "s"),
        ]
