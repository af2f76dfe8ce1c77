"""`task=train`: fit a generator, judge it, write previews."""

from __future__ import annotations

from itertools import islice

import pytorch_lightning as pl
from hydra.utils import instantiate
from omegaconf import DictConfig

from motiongen.data.datamodule import MotionData
from motiongen.evaluation.latents import latent_space
from motiongen.generation.checkpoint import save_generator
from motiongen.generation.fitting import fit
from motiongen.generation.lightning import TrainingShell
from motiongen.runs import GENERATOR_FILE
from motiongen.tasks.assembly import build_data, first_generator, run_folder
from motiongen.tasks.judging import judge
from motiongen.tasks.latency import latency
from motiongen.tasks.previews import write_previews
from motiongen.tasks.record import Record

PRUNED_BY = 32
"""Held-out clips by which a trial is judged in between."""


def run(config: DictConfig) -> None:
    """Train, evaluate and preview; everything lies in the run folder and in the tracker."""
    folder = run_folder()
    with Record(config, folder) as record:
        data = build_data(config)
        record.data(data)
        generator, seen = first_generator(config, data)
        shell = TrainingShell(
            generator, instantiate(config.objective), data.skeleton, instantiate(config.optimizer), config.seed
        )
        fit(
            shell,
            data,
            instantiate(config.trainer, _partial_=True),
            folder / "checkpoints",
            record.tracker,
            resume=config.resume is not None,
            callbacks=pruning(config, data),
        )
        generator.eval().conclude(data.train_windows(config.evaluation.batch_size))
        trained_on = sorted({*seen, *data.frames_of(data.split.train)})
        save_generator(folder / GENERATOR_FILE, generator, data.tags, trained_on)
        evaluation = judge(config, data, generator)
        record.evaluation(evaluation)
        space = latent_space(generator, data, config.evaluation.batch_size, config.evaluation.first_seed)
        if space is not None:
            record.latents(space)
        record.latency(latency(generator, data.test_batches(1)))
        record.previews(*write_previews(folder, config, data, generator))
    record.print_outcome()


def pruning(config: DictConfig, data: MotionData) -> list[pl.Callback]:
    """What ends a trial of a search early, if this is one that may end so."""
    trial = config.trial
    if trial.number is None or not trial.prune:
        return []
    from motiongen.search.pruning import PruneTrial

    batches = list(islice(data.test_batches(PRUNED_BY), 1))
    return [PruneTrial(trial.name, trial.storage, trial.number, batches, data.skeleton)]
