from __future__ import annotations

import copy
import json
import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch

from motiongen.data.datamodule import MotionData
from motiongen.recognition.cache import INFO, WEIGHTS, obtain_recognizer
from motiongen.recognition.recognizer import TrainedRecognizer
from tests.recognition.corpus import three_actions


def config(epochs: int = 12) -> dict[str, Any]:
    network = {"width": 32, "heads": 2, "layers": 1, "feedforward": 32, "feature_width": 8, "dropout": 0.0}
    return {
        "network": {
            "_target_": "motiongen.recognition.transformer.TransformerRecognizer",
            "_partial_": True,
            **network,
        },
        "training": {
            "_target_": "motiongen.recognition.training.RecognizerTraining",
            "epochs": epochs,
            "batch_size": 8,
            "epoch_steps": 3,
            "learning_rate": 0.01,
        },
    }


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> MotionData:
    return three_actions(tmp_path_factory.mktemp("data"))


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def trained(data: MotionData, cache: Path) -> TrainedRecognizer:
    return obtain_recognizer(config(), data, cache)


def logits(recognizer: TrainedRecognizer, data: MotionData) -> torch.Tensor:
    with torch.no_grad():
        batches = list(data.test_batches(8))
        return torch.cat([recognizer.recognizer(batch.motion, batch.condition.mask).logits for batch in batches])


def folder(cache: Path, recognizer: TrainedRecognizer) -> Path:
    return cache / "recognizers" / recognizer.fingerprint


def test_it_learns_to_tell_actions_apart(trained: TrainedRecognizer) -> None:
    assert trained.was_trained
    assert trained.test_accuracy == 1.0
    assert not trained.recognizer.training


def test_a_hit_gives_the_same_outputs_without_training(
    trained: TrainedRecognizer, data: MotionData, cache: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    before = torch.random.get_rng_state()
    found = obtain_recognizer(config(), data, cache)
    assert not found.was_trained
    assert "training" not in caplog.text
    assert (found.fingerprint, found.test_accuracy) == (trained.fingerprint, trained.test_accuracy)
    assert torch.equal(logits(found, data), logits(trained, data))
    assert torch.equal(torch.random.get_rng_state(), before)


def test_the_same_seed_trains_the_same_weights_whatever_the_caller_s_random_state(
    trained: TrainedRecognizer, data: MotionData, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    torch.rand(5)
    before = torch.random.get_rng_state()
    again = obtain_recognizer(config(), data, tmp_path)
    assert "training one" in caplog.text
    assert torch.equal(torch.random.get_rng_state(), before)
    weights = trained.recognizer.state_dict()
    assert all(torch.equal(weights[name], value) for name, value in again.recognizer.state_dict().items())


def test_other_settings_and_other_data_have_recognizers_of_their_own(
    trained: TrainedRecognizer, data: MotionData, cache: Path, tmp_path: Path
) -> None:
    other_settings = obtain_recognizer(config(epochs=1), data, cache)
    other_data = obtain_recognizer(config(epochs=1), three_actions(tmp_path, seed=1), cache)
    assert len({trained.fingerprint, other_settings.fingerprint, other_data.fingerprint}) == 3


def test_a_damaged_file_is_named(data: MotionData, tmp_path: Path) -> None:
    recognizer = obtain_recognizer(config(epochs=1), data, tmp_path)
    place = folder(tmp_path, recognizer)
    whole = (place / WEIGHTS).read_bytes()
    (place / WEIGHTS).write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ValueError, match=str(place)):
        obtain_recognizer(config(epochs=1), data, tmp_path)
    (place / WEIGHTS).write_bytes(whole)
    (place / INFO).write_text("{}")
    with pytest.raises(ValueError, match=str(place)):
        obtain_recognizer(config(epochs=1), data, tmp_path)


def test_nothing_but_whole_folders_is_left(trained: TrainedRecognizer, cache: Path) -> None:
    names = sorted(path.name for path in folder(cache, trained).parent.iterdir() if path.is_dir())
    assert all(len(name) == 64 for name in names)
    info = json.loads((folder(cache, trained) / INFO).read_text())
    assert info["test_accuracy"] == trained.test_accuracy
    assert info["tags"] == ["stand", "walk", "wave"]


def test_a_split_that_leaks_is_refused(data: MotionData, tmp_path: Path) -> None:
    leaking = copy.copy(data)
    leaking.split = replace(data.split, train=data.split.train + data.split.test[:1])
    with pytest.raises(ValueError, match="share 1 groups"):
        obtain_recognizer(config(epochs=1), leaking, tmp_path)
    assert not [path for path in (tmp_path / "recognizers").iterdir() if path.is_dir()]
