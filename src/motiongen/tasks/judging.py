"""Generators before the recognizers, beside the real clips."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from motiongen.contracts import GeneratorModule
from motiongen.data.datamodule import MotionData
from motiongen.evaluation.archive import Archive, generator_fingerprint
from motiongen.evaluation.evaluator import Recorded, System, evaluate
from motiongen.evaluation.results import Evaluation
from motiongen.recognition.cache import obtain_recognizer
from motiongen.tasks.assembly import build_generator


def judge(config: DictConfig, data: MotionData, generator: GeneratorModule) -> tuple[Evaluation, ...]:
    """Evaluate `generated`, and `untrained`, the same composition with its first weights."""
    device = next(generator.parameters()).device
    untrained = build_generator(config, data).to(device)
    systems = {"generated": system(config, generator), "untrained": system(config, untrained)}
    return judge_systems(config, data, systems, str(device))


def judge_systems(
    config: DictConfig, data: MotionData, systems: Mapping[str, System | Recorded], device: str = "cpu"
) -> tuple[Evaluation, ...]:
    """Evaluate under `config.evaluation`: one evaluation under `recognizer`, another under `second_recognizer`.

    Args:
        config: of the task.
        data: whose test split is used.
        systems: by name.
        device: where they generate.
    """
    cache = Path(config.cache)
    settings = [one for one in (config.recognizer, config.second_recognizer) if one is not None]
    recognizers = [obtain_recognizer(one, data, cache) for one in settings]
    for one in recognizers:
        one.recognizer.to(device)
    return evaluate(systems, data, recognizers, instantiate(config.evaluation), Archive(cache / "judgements"))


def system(config: DictConfig, generator: GeneratorModule) -> System:
    """A generator as evaluation sees it, `config` being that of its run."""
    settings = OmegaConf.to_container(config.generator, resolve=True)
    return System(generator.generate, generator_fingerprint(generator, settings))
