"""From a checked configuration to the objects that tasks work with."""

from __future__ import annotations

from pathlib import Path

import torch
from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig

from motiongen.contracts import GeneratorModule
from motiongen.data.clips import INITIAL_FRAMES
from motiongen.data.datamodule import MotionData
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


def trained_generator(config: DictConfig, data: MotionData) -> GeneratorModule:
    """The generator that the run in the folder `config.run` trained."""
    return _load(config.run, build_generator(config, data), data).eval()


def first_generator(config: DictConfig, data: MotionData) -> GeneratorModule:
    """What training starts from: the generator of the run in the folder `config.init`, or an untrained one."""
    generator = build_generator(config, data)
    return generator if config.init is None else _load(config.init, generator, data)


def _load(run: str, generator: GeneratorModule, data: MotionData) -> GeneratorModule:
    load_generator(Path(run) / GENERATOR_FILE, generator, data.tags)
    return generator


def build_body(config: DictConfig, data: MotionData) -> Body:
    """The body of `config.body` with the bones of the data, so that recorded motion stands on the floor."""
    body: Body = instantiate(config.body)
    return body.fitted_to(data.skeleton)
