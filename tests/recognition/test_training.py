import math
from pathlib import Path

import pytest
import torch

from motiongen.recognition.training import RecognizerTraining, epoch_batches, smoothed_cross_entropy
from tests.recognition.corpus import three_actions


def test_the_tags_of_a_clip_share_its_weight() -> None:
    logits = torch.tensor([[1.0, 2.0, 0.5, -1.0]])
    log_shares = torch.log_softmax(logits, dim=1)[0]
    loss = smoothed_cross_entropy(logits, torch.tensor([[1.0, 0.0, 1.0, 0.0]]), smoothing=0.2)
    target = torch.tensor([0.45, 0.05, 0.45, 0.05])
    assert float(loss) == pytest.approx(-float((target * log_shares).sum()), rel=1e-6)


def test_one_hot_tags_give_the_usual_cross_entropy() -> None:
    logits = torch.randn(6, 4, generator=torch.Generator().manual_seed(0))
    labels = torch.tensor([0, 1, 2, 3, 1, 1])
    expected = torch.nn.functional.cross_entropy(logits, labels)
    tags = torch.nn.functional.one_hot(labels).float()
    torch.testing.assert_close(smoothed_cross_entropy(logits, tags, smoothing=0.0), expected)


def test_the_learning_rate_rises_then_falls_to_zero() -> None:
    settings = RecognizerTraining(learning_rate=0.5, warmup=0.25)
    assert settings.rate(0.0) == 0.0
    assert settings.rate(0.125) == pytest.approx(0.25 * 0.5 * (1 + math.cos(math.pi / 8)))
    assert settings.rate(0.5) == pytest.approx(0.25)
    assert settings.rate(1.0) == pytest.approx(0.0)
    assert RecognizerTraining(learning_rate=0.5, warmup=0.0).rate(0.0) == 0.5


def test_an_epoch_shows_every_clip_and_a_small_set_more_than_once(tmp_path: Path) -> None:
    clips = three_actions(tmp_path).train_items()
    lengths = [
        sum(len(batch.motion) for batch in epoch_batches(clips, RecognizerTraining(batch_size=7, epoch_steps=steps), 0))
        for steps in (1, 8)
    ]
    assert lengths == [len(clips), 2 * len(clips)] == [24, 48]
