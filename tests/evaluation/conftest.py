from __future__ import annotations

import pytest
import torch

from motiongen.data.datamodule import MotionData
from motiongen.recognition.recognizer import TrainedRecognizer
from motiongen.recognition.transformer import TransformerRecognizer
from tests.recognition.corpus import three_actions


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> MotionData:
    return three_actions(tmp_path_factory.mktemp("data"))


@pytest.fixture(scope="module")
def recognizer(data: MotionData) -> TrainedRecognizer:
    with torch.random.fork_rng():
        torch.manual_seed(0)
        network = TransformerRecognizer(tags=3, skeleton=data.skeleton, width=16, heads=2, layers=1, feature_width=8)
    return TrainedRecognizer(network, 0.5, "f" * 64, data.fingerprint, was_trained=False)
