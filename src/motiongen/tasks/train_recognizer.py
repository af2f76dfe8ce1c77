"""`task=train_recognizer`: the classifier that evaluation measures with."""

from __future__ import annotations

from pathlib import Path

from omegaconf import DictConfig

from motiongen.recognition.cache import obtain_recognizer
from motiongen.tasks.assembly import build_data, run_folder
from motiongen.tasks.record import Record


def run(config: DictConfig) -> None:
    """Train the recognizer of this data unless the cache holds it."""
    with Record(config, run_folder()) as record:
        data = build_data(config)
        record.data(data)
        recognizer = obtain_recognizer(config.recognizer, data, Path(config.cache))
        record.recognizer(recognizer)
    record.print_outcome()
