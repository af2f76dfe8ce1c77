import math

import numpy as np
import pytest
import torch
from scipy.stats import entropy
from sklearn.metrics import (
    accuracy_score,
    balanced_accuracy_score,
    confusion_matrix,
    recall_score,
    top_k_accuracy_score,
)
from torch import Tensor

from motiongen.evaluation.metrics.classification import (
    accuracy,
    balanced_accuracy,
    class_accuracy,
    confusion,
    inception_score,
    top_k_accuracy,
)

TAGS = 7


@pytest.fixture
def logits() -> Tensor:
    return torch.randn(200, TAGS, generator=torch.Generator().manual_seed(0))


@pytest.fixture
def labels() -> Tensor:
    """Of very different frequency; the last tag has no clip."""
    weights = torch.tensor([1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 0.0])
    return torch.multinomial(weights, 200, replacement=True, generator=torch.Generator().manual_seed(1))


def one_hot(labels: Tensor) -> Tensor:
    return torch.nn.functional.one_hot(labels, TAGS).float()


def test_one_hot_accuracy_is_sklearn_s(logits: Tensor) -> None:
    labels = torch.randint(0, TAGS, (200,), generator=torch.Generator().manual_seed(1))
    tags, guesses = one_hot(labels), logits.argmax(dim=1)
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


@pytest.mark.parametrize("k", [1, 2, 6])
def test_one_hot_top_k_accuracy_is_sklearn_s(logits: Tensor, labels: Tensor, k: int) -> None:
    expected = top_k_accuracy_score(labels, logits, k=k, labels=list(range(TAGS)))
    assert 0 < expected < 1
    assert top_k_accuracy(logits, one_hot(labels), k) == pytest.approx(expected, abs=1e-12)


def test_top_k_accuracy_needs_one_of_a_clip_s_tags_among_the_likeliest() -> None:
    logits = torch.tensor([[3.0, 2.0, 1.0, 0.0], [3.0, 2.0, 1.0, 0.0]])
    tags = torch.tensor([[0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.0, 1.0]])
    assert [top_k_accuracy(logits, tags, k) for k in (1, 2, 3, 4)] == [0.0, 0.0, 0.5, 1.0]


@pytest.mark.parametrize("k", [0, TAGS + 1])
def test_top_k_accuracy_refuses_a_k_that_there_is_not(logits: Tensor, labels: Tensor, k: int) -> None:
    with pytest.raises(ValueError, match=f"the {k} most likely of {TAGS} tags"):
        top_k_accuracy(logits, one_hot(labels), k)


def test_balanced_accuracy_is_sklearn_s_also_where_a_tag_has_no_clip(logits: Tensor, labels: Tensor) -> None:
    # Clips of the commonest tag are right more often, so that the plain accuracy is another number.
    logits[labels == 5, 5] += 2
    tags = one_hot(labels)
    # sklearn warns of guesses of the tag that no clip has, and leaves it out as well.
    with pytest.warns(UserWarning, match="y_pred contains classes not in y_true"):
        expected = balanced_accuracy_score(labels, logits.argmax(dim=1))
    assert balanced_accuracy(logits, tags) == pytest.approx(expected, abs=1e-12)
    assert abs(accuracy(logits, tags) - expected) > 0.1
    assert math.isnan(balanced_accuracy(logits, torch.zeros_like(tags)))


def test_one_hot_confusion_is_sklearn_s(logits: Tensor, labels: Tensor) -> None:
    expected = confusion_matrix(labels, logits.argmax(dim=1), labels=list(range(TAGS)))
    found = confusion(logits, one_hot(labels))
    assert found.dtype == torch.float64
    assert found.tolist() == expected.tolist()


def test_a_clip_of_several_tags_is_confused_in_equal_shares_and_one_without_tags_not_at_all() -> None:
    logits = torch.tensor([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    tags = torch.tensor([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    assert confusion(logits, tags).tolist() == [[0.0, 0.5, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]]


def test_inception_score_is_the_exponential_of_scipy_s_mean_divergence(logits: Tensor) -> None:
    given = np.exp(logits.double().numpy())
    given /= given.sum(axis=1, keepdims=True)
    expected = np.exp(np.mean([entropy(row, given.mean(axis=0)) for row in given]))
    assert inception_score(logits) == pytest.approx(expected, rel=1e-12)
    assert inception_score(logits.flip(0) + 100.0) == pytest.approx(expected, rel=1e-5)


def test_inception_score_is_the_number_of_tags_that_are_seen_beyond_doubt_and_equally_often() -> None:
    sure = 1000.0 * torch.eye(TAGS).repeat(3, 1)
    assert inception_score(sure) == pytest.approx(TAGS, rel=1e-12)
    assert inception_score(sure[:4]) == pytest.approx(4, rel=1e-12)
    assert inception_score(sure[:1].repeat(5, 1)) == pytest.approx(1, rel=1e-12)
    assert inception_score(torch.zeros(5, TAGS)) == pytest.approx(1, rel=1e-12)


def test_inception_score_needs_a_clip() -> None:
    with pytest.raises(ValueError, match="at least 1 clip"):
        inception_score(torch.zeros(0, TAGS))
