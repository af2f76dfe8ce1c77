"""`task=compare runs=[...]`: the generators of several runs in one table, on the same clips."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

from omegaconf import DictConfig

from motiongen.configuration import compose
from motiongen.data.datamodule import MotionData
from motiongen.evaluation.evaluator import System
from motiongen.evaluation.leaks import refuse_trained_clips
from motiongen.generation.checkpoint import load_generator
from motiongen.runs import GENERATOR_FILE, run_folder_of, stored_overrides
from motiongen.tasks.assembly import build_data, build_generator, run_folder
from motiongen.tasks.judging import judge_systems, system
from motiongen.tasks.record import Record


def run(config: DictConfig) -> None:
    """Judge the runs on the data of this command; differences are taken from the first run."""
    with Record(config, run_folder()) as record:
        data = build_data(config)
        record.data(data)
        systems: dict[str, System] = {}
        groups: dict[str, list[str]] = defaultdict(list)
        for named in config.runs:
            composition, seed, found = trained_system(run_folder_of(named), data)
            name = f"{composition}-s{seed}"
            if name in systems:
                name = f"{name}-{len(systems) + 1}"
            systems[name] = found
            groups[composition].append(name)
        several = any(len(names) > 1 for names in groups.values())
        record.evaluation(judge_systems(config, data, systems), groups if several else {})
    record.print_outcome()


def trained_system(folder: Path, data: MotionData) -> tuple[str, int, System]:
    """A run's name, its seed, and its generator.

    Raises:
        RunError: the folder is not that of a run.
        CheckpointError: its generator is missing or was made for other tags.
        LeakError: it was trained on test clips of this data.
    """
    config = compose([text for text in stored_overrides(folder, "runs") if not text.startswith("hydra.")])
    generator = build_generator(config, data)
    refuse_trained_clips(load_generator(folder / GENERATOR_FILE, generator, data.tags), data)
    return str(config.name), int(config.seed), system(config, generator.eval())
