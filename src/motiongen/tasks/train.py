"""`task=train`: fit a generator, judge it, write previews."""

from __future__ import annotations

from hydra.utils import instantiate
from omegaconf import DictConfig

from motiongen.generation.checkpoint import save_generator
from motiongen.generation.fitting import fit
from motiongen.generation.lightning import TrainingShell
from motiongen.runs import GENERATOR_FILE
from motiongen.tasks.assembly import build_data, first_generator, run_folder
from motiongen.tasks.judging import judge
from motiongen.tasks.previews import write_previews
from motiongen.tasks.record import Record


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
        )
        generator.eval().conclude(data.train_windows(config.evaluation.batch_size))
        trained_on = sorted({*seen, *data.frames_of(data.split.train)})
        save_generator(folder / GENERATOR_FILE, generator, data.tags, trained_on)
        evaluation = judge(config, data, generator)
        record.evaluation(evaluation)
        record.previews(*write_previews(folder, config, data, generator))
    record.print_outcome()
