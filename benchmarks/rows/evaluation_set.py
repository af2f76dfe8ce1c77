"""An evaluation set of the paper's size: 764 motions of 20 actions made with Shadow Start, each action judged.

MARIONET at `scale=small` and a recognizer, both with first weights, on sequences of built-in motion. Judging the real
clips of the sequences, as is done beside every system, is in the time; training is not.
"""

from __future__ import annotations

import tempfile
import time

import torch
from hydra.utils import instantiate

from benchmarks.measuring import Effort
from benchmarks.results import Figure, Result
from motiongen.configuration import compose
from motiongen.recognition.recognizer import TrainedRecognizer
from motiongen.tasks.assembly import build_data, build_generator
from motiongen.tasks.long_motion import Stage
from motiongen.tasks.trained import TrainedRun

TITLE = "An evaluation set of long motions"


def measure(effort: Effort) -> list[Result]:
    count, actions = effort.size(764, 3), effort.size(20, 2)
    with tempfile.TemporaryDirectory() as folder:
        options = [f"cache={folder}", f"data.source.sessions={effort.size(36, 6)}", "data.min_clips=2"]
        options += [f"sequences.count={count}", f"sequences.actions={actions}", "sequences.confidence=0.0"]
        scale = "smoke" if effort.quick else "small"
        config = compose(["task=long_motion", f"scale={scale}", "corrections=shadow_start", *options])
        made_by = compose(["+experiment=marionette", f"scale={scale}", *options])
        data = build_data(config)
        torch.manual_seed(0)
        generator = build_generator(made_by, data).eval()
        generator.conclude(data.train_windows(config.evaluation.batch_size))
        network = instantiate(config.recognizer.network)(tags=len(data.tags), skeleton=data.skeleton).eval()
        recognizer = TrainedRecognizer(network, 0.0, "first weights", data.fingerprint, False)
        stage = Stage.of(data, instantiate(config.sequences), [recognizer], config.evaluation)
        run = TrainedRun("marionette", "marionette", made_by, generator)
        corrections = {name: instantiate(one) for name, one in config.corrections.items()}
        start = time.perf_counter()
        stage.judged("overall", [run], corrections)
        minutes = (time.perf_counter() - start) / 60
    return [Figure(f"{count} motions of {actions} actions", minutes, "min", "under 30 min")]
