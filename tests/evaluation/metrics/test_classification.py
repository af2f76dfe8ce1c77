import pytest
import torch
from sklearn.metrics import accuracy_score, recall_score

from motiongen.evaluation.metrics.classification import accuracy, class_accuracy


def test_one_hot_accuracy_is_sklearn_s() -> None:
    generator = torch.Generator().manual_seed(0)
    logits = torch.randn(200, 7, generator=generator)
    labels = torch.randint(0, 7, (200,), generator=generator)
    tags = torch.nn.functional.one_hot(labels, 7).float()
    guesses = logits.argmax(dim=1)
    assert accuracy(logits, tags) == pytest.approx(accuracy_score(labels, guesses), abs=1e-12)
    recall = torch.as_tensor(recall_score(labels, guesses, average=None))
    torch.testing.assert_close(class_accuracy(logits, tags), recall, atol=1e-12, rtol=0)


def test_any_of_a_clip_s_tags_counts_and_an_absent_tag_has_no_accuracy() -> None:
    logits = torch.tensor([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    tags = torch.tensor([[1.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    assert accuracy(logits, tags) == 0.5
    found = class_accuracy(logits, tags)
    assert found[:2].tolist() == [0.5, 1.0]
    assert found[2].isnan()
