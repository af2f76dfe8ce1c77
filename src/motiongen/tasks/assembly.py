"""From a checked configuration to the objects that tasks work with."""

from __future__ import annotations

from pathlib import Path

import torch
from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig

from motiongen.contracts import GeneratorModule
from motiongen.data.clips import INITIAL_FRAMES, Span
from motiongen.data.datamodule import MotionData
from motiongen.evaluation.leaks import refuse_trained_clips
from motiongen.generation.checkpoint import load_generator
from motiongen.motion.bodies.body import Body
from motiongen.motion.representation import FEATURES
from motiongen.runs import GENERATOR_FILE


def run_folder() -> Path:
    """The folder that Hydra made for this job."""
    return Path(HydraConfig.get().runtime.output_dir)


def build_data(config: DictConfig) -> MotionData:
    """The data of `config.data`, parsed now if it never was."""
    data: MotionData = instantiate(config.data)
    return data


def build_generator(config: DictConfig, data: MotionData) -> GeneratorModule:
    """The composition of `config.generator` for this data; its first weights depend on `config.seed` alone."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(config.seed)
        generator: GeneratorModule = instantiate(config.generator)(
            features=FEATURES, tags=len(data.tags), initial_frames=INITIAL_FRAMES, styles=len(data.styles)
        )
    return generator


def trained_generator(config: DictConfig, data: MotionData) -> tuple[GeneratorModule, tuple[Span, ...]]:
    """The generator that the run in the folder `config.run` trained, and the frames that it was trained on."""
    generator = build_generator(config, data)
    trained_on = load_generator(Path(config.run) / GENERATOR_FILE, generator, data.tags)
    return generator.eval(), trained_on


def first_generator(config: DictConfig, data: MotionData) -> tuple[GeneratorModule, tuple[Span, ...]]:
    """What training starts from, and the frames that it has seen: the generator of the run in the folder `config.init`,
    or an untrained one that has seen none.

    Raises:
        LeakError: the other run was trained on test clips of this one.
    """
    generator = build_generator(config, data)
    if config.init is None:
        return generator, ()
    trained_on = load_generator(Path(config.init) / GENERATOR_FILE, generator, data.tags)
    refuse_trained_clips(trained_on, data)
    return generator, trained_on


def build_body(config: DictConfig, data: MotionData) -> Body:
    """The body of `config.body` with the bones of the data, so that recorded motion stands on the floor."""
    body: Body = instantiate(config.body)
    return body.fitted_to(data.skeleton)
