"""Recognizers on disk, one folder for every combination of data and settings."""

from __future__ import annotations

import json
import logging
import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch
from filelock import FileLock
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from motiongen.documents import DocumentError, read_json
from motiongen.errors import InputError
from motiongen.motion.skeleton import Skeleton
from motiongen.recognition.recognizer import RecognizerBuilder, TrainedRecognizer
from motiongen.recognition.training import RecognizerTraining, recognized_share, train
from motiongen.weights import read_weights

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
            return load_recognizer(folder, build, data.tags, data.skeleton, fingerprint)
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


def load_recognizer(
    folder: Path, build: RecognizerBuilder, tags: Sequence[str], skeleton: Skeleton, fingerprint: str
) -> TrainedRecognizer:
    """The recognizer in a folder of the cache, in eval mode.

    Args:
        folder: with the recognizer's two files.
        build: its network.
        tags: what it tells apart.
        skeleton: the body of the data.
        fingerprint: of the data and settings.

    Raises:
        InputError: a file is damaged; the message names it and its folder.
    """
    # Building draws initial weights: the caller's random state must not depend on whether the cache was hit.
    with torch.random.fork_rng(devices=[]):
        recognizer = build(tags=len(tags), skeleton=skeleton)
    try:
        info = _info(folder / INFO, tags)
        recognizer.load_state_dict(read_weights(folder / WEIGHTS))
        if not all(value.isfinite().all() for value in recognizer.state_dict().values()):
            raise ValueError("not all weights are finite")
    except Exception as error:
        # Weights of another form than the network's can make it raise nearly anything.
        at_fault = INFO if isinstance(error, DocumentError) else WEIGHTS
        told = f"{' '.join(str(error).split()):.500}"
        message = (
            f"the cached recognizer in {folder} is damaged; delete that folder to train it anew: {at_fault}: {told}"
        )
        raise InputError(message) from error
    accuracy, trained_on = float(info["test_accuracy"]), info["data_fingerprint"]
    return TrainedRecognizer(recognizer.eval(), accuracy, fingerprint, trained_on, was_trained=False)


def _info(path: Path, tags: Sequence[str]) -> dict[str, Any]:
    info = read_json(path)
    fields: dict[str, Any] = info if isinstance(info, dict) else {}
    accuracy: Any = fields.get("test_accuracy")
    if type(accuracy) not in (int, float) or not 0 <= accuracy <= 1:
        raise DocumentError("field 'test_accuracy' is not a share")
    if not isinstance(fields.get("data_fingerprint"), str):
        raise DocumentError("field 'data_fingerprint' is not text")
    if fields.get("tags") != list(tags):
        raise DocumentError("field 'tags' is not that of the data")
    return fields
