"""`task=compare runs=[...]`: the generators of several runs in one table, on the same clips."""

from __future__ import annotations

from pathlib import Path

from omegaconf import DictConfig

from motiongen.configuration import compose
from motiongen.data.datamodule import MotionData
from motiongen.evaluation.evaluator import System
from motiongen.evaluation.leaks import refuse_trained_clips
from motiongen.generation.checkpoint import load_generator
from motiongen.runs import GENERATOR_FILE, stored_overrides
from motiongen.tasks.assembly import build_data, build_generator, run_folder
from motiongen.tasks.judging import judge_systems, system
from motiongen.tasks.record import Record


def run(config: DictConfig) -> None:
    """Judge the runs on the data of this command; differences are taken from the first run."""
    with Record(config, run_folder()) as record:
        data = build_data(config)
        record.data(data)
        systems: dict[str, System] = {}
        for folder in config.runs:
            name, found = trained_system(Path(folder), data)
            systems[name if name not in systems else f"{name}-{len(systems) + 1}"] = found
        record.evaluation(judge_systems(config, data, systems))
    record.print_outcome()


def trained_system(folder: Path, data: MotionData) -> tuple[str, System]:
    """The generator of a run, and the run's name with its seed.

    Raises:
        RunError: the folder is not that of a run.
        CheckpointError: its generator is missing or was made for other tags.
        LeakError: it was trained on test clips of this data.
    """
    config = compose([text for text in stored_overrides(folder, "runs") if not text.startswith("hydra.")])
    generator = build_generator(config, data)
    refuse_trained_clips(load_generator(folder / GENERATOR_FILE, generator, data.tags), data)
    return f"{config.name}-s{config.seed}", system(config, generator.eval())
