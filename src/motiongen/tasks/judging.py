"""A generator before the recognizer, beside the real clips and itself untrained."""

from __future__ import annotations

from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from motiongen.contracts import GeneratorModule
from motiongen.data.datamodule import MotionData
from motiongen.evaluation.protocol import evaluate
from motiongen.evaluation.results import Evaluation
from motiongen.recognition.cache import obtain_recognizer
from motiongen.tasks.assembly import build_generator


def judge(config: DictConfig, data: MotionData, generator: GeneratorModule) -> Evaluation:
    """Evaluate under `config.evaluation`: `generated`, and `untrained`, the same composition with its first weights."""
    recognizer = obtain_recognizer(config.recognizer, data, Path(config.cache))
    device = next(generator.parameters()).device
    recognizer.recognizer.to(device)
    untrained = build_generator(config, data).to(device)
    systems = {"generated": generator.generate, "untrained": untrained.generate}
    return evaluate(systems, data, recognizer, instantiate(config.evaluation))
