"""Recognizers on disk, one folder for every combination of data and settings."""

from __future__ import annotations

import json
import logging
import os
import pickle
import shutil
import tempfile
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch
from filelock import FileLock
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from motiongen.errors import InputError
from motiongen.recognition.recognizer import RecognizerBuilder, TrainedRecognizer
from motiongen.recognition.training import RecognizerTraining, recognized_share, train

if TYPE_CHECKING:
    from motiongen.data.datamodule import MotionData

log = logging.getLogger(__name__)

REVISION = 1
"""Raised whenever the code changes what the same settings train, so that older files are not taken for it."""
WEIGHTS, INFO = "weights.pt", "info.json"
TEST_BATCH = 64


def obtain_recognizer(config: Mapping[str, Any] | DictConfig, data: MotionData, cache: Path) -> TrainedRecognizer:
    """The recognizer of this data and these settings: from the cache, or trained now, which is logged.

    Args:
        config: the config group `recognizer`: `network` builds a recognizer, `training` says how it is trained.
        data: only its training split is learned from; the test split gives the reported accuracy.
        cache: folder that holds `recognizers/<fingerprint>/`. Two processes may ask at once; one of them trains.

    Raises:
        InputError: a cached file is damaged; the message names its folder.
        ValueError: the split leaks.
    """
    settings: Any = OmegaConf.to_container(config, resolve=True) if isinstance(config, DictConfig) else dict(config)
    fingerprint = sha256(json.dumps([REVISION, data.fingerprint, settings], sort_keys=True).encode()).hexdigest()
    folder = cache / "recognizers" / fingerprint
    folder.parent.mkdir(parents=True, exist_ok=True)
    build, training = instantiate(settings["network"]), instantiate(settings["training"])
    with FileLock(folder.with_suffix(".lock")):
        if folder.exists():
            return _load(folder, build, data, fingerprint)
        log.info("no recognizer for this data and these settings in %s: training one", folder.parent)
        return _train(folder, build, training, data, fingerprint)


def _train(
    folder: Path, build: RecognizerBuilder, training: RecognizerTraining, data: MotionData, fingerprint: str
) -> TrainedRecognizer:
    recognizer = train(build, training, data)
    accuracy = recognized_share(recognizer, data.test_batches(TEST_BATCH))
    info = {"test_accuracy": accuracy, "data_fingerprint": data.fingerprint, "tags": list(data.tags)}
    # A folder appears whole or not at all.
    temporary = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=folder.parent))
    try:
        torch.save(recognizer.state_dict(), temporary / WEIGHTS)
        (temporary / INFO).write_text(json.dumps(info, indent=2), encoding="utf-8")
        os.replace(temporary, folder)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    log.info("recognizer %s: accuracy %.3f on real test clips", fingerprint[:12], accuracy)
    return TrainedRecognizer(recognizer, accuracy, fingerprint, data.fingerprint, was_trained=True)


def _load(folder: Path, build: RecognizerBuilder, data: MotionData, fingerprint: str) -> TrainedRecognizer:
    # Building draws initial weights: the caller's random state must not depend on whether the cache was hit.
    with torch.random.fork_rng(devices=[]):
        recognizer = build(tags=len(data.tags), skeleton=data.skeleton)
    try:
        info = json.loads((folder / INFO).read_text(encoding="utf-8"))
        accuracy, trained_on = float(info["test_accuracy"]), str(info["data_fingerprint"])
        weights = torch.load(folder / WEIGHTS, map_location="cpu", weights_only=True)
        recognizer.load_state_dict(weights)
    except (OSError, EOFError, KeyError, ValueError, RuntimeError, pickle.UnpicklingError) as error:
        message = f"the cached recognizer in {folder} is damaged; delete that folder to train it anew: {error}"
        raise InputError(message) from error
    return TrainedRecognizer(recognizer.eval(), accuracy, fingerprint, trained_on, was_trained=False)
