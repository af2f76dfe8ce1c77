"""Folders of runs that ended before their first step."""

from __future__ import annotations

from pathlib import Path

from omegaconf import OmegaConf

from motiongen.configuration import compose
from motiongen.generation.checkpoint import save_generator
from motiongen.tasks.assembly import build_data, build_generator

COMMON = ["scale=smoke", "data.source.sessions=8", "data.min_clips=2", "evaluation.seeds=2", "tracker=none"]


def untrained_run(folder: Path, experiment: str, *changes: str) -> Path:
    """The folder of a run that ended before its first step."""
    overrides = [f"+experiment={experiment}", *COMMON, f"cache={folder.parent / 'cache'}", *changes]
    config = compose(overrides)
    (folder / ".hydra").mkdir(parents=True)
    OmegaConf.save(OmegaConf.create(overrides), folder / ".hydra" / "overrides.yaml")
    data = build_data(config)
    generator = build_generator(config, data)
    generator.eval().conclude(data.train_windows(64))
    save_generator(folder / "generator.pt", generator, data.tags, data.frames_of(data.split.train))
    return folder
