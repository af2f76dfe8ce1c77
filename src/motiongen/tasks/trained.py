"""Runs that are judged side by side: their generators, under names that tell them apart."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from omegaconf import DictConfig

from motiongen.configuration import compose
from motiongen.contracts import GeneratorModule
from motiongen.data.datamodule import MotionData
from motiongen.evaluation.leaks import refuse_trained_clips
from motiongen.evaluation.stored import read_summary
from motiongen.generation.checkpoint import load_generator
from motiongen.runs import GENERATOR_FILE, SUMMARY_FILE, run_folder_of, stored_overrides
from motiongen.tasks.assembly import build_generator


@dataclass(frozen=True)
class TrainedRun:
    """One training that has finished."""

    name: str
    """The composition with the seed, and a number where that is not enough to tell runs apart"""
    composition: str
    """The experiment with what the command line changed of it"""
    config: DictConfig
    generator: GeneratorModule


def trained_runs(named: Iterable[str], data: MotionData, *, trust: bool) -> list[TrainedRun]:
    """The runs in these folders, in order.

    Args:
        named: the folders.
        data: that they are judged on.
        trust: whether the runs may name code that no installed option offers.

    Raises:
        RunError: a folder is not that of a run, or names such code.
        ConfigurationError: what a run was started with is no configuration any more.
        CheckpointError: a generator is missing or was made for other tags.
        LeakError: one was trained on test clips of this data.
    """
    runs: list[TrainedRun] = []
    for folder in map(run_folder_of, named):
        config = compose(stored_overrides(folder, "runs", trust=trust))
        generator = build_generator(config, data)
        refuse_trained_clips(load_generator(folder / GENERATOR_FILE, generator, data.tags), data)
        composition = _composition(folder, config)
        name = f"{composition}-s{config.seed}"
        if name in [run.name for run in runs]:
            name = f"{name}-{len(runs) + 1}"
        runs.append(TrainedRun(name, composition, config, generator.eval()))
    return runs


def grouped(runs: Iterable[TrainedRun]) -> dict[str, list[str]]:
    """The names of the trainings of each composition, where one has several; else nothing."""
    groups: dict[str, list[str]] = defaultdict(list)
    for run in runs:
        groups[run.composition].append(run.name)
    return dict(groups) if any(len(names) > 1 for names in groups.values()) else {}


def _composition(folder: Path, config: DictConfig) -> str:
    """The experiment's name, and what stands behind the seed in the run's: what the command line changed."""
    name = str(read_summary(folder).get("name", "")) if (folder / SUMMARY_FILE).is_file() else ""
    _, _, changed = name.partition(f"-s{config.seed}-")
    return f"{config.name}-{changed}" if changed else str(config.name)
