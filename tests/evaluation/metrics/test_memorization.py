import pytest
import torch
from sklearn.neighbors import NearestNeighbors

from motiongen.evaluation.metrics.memorization import nearest_training_distance
from tests.evaluation.metrics.clouds import samples, turn


def test_distances_are_sklearn_s() -> None:
    features, training = samples(30, 6, 1), samples(80, 6, 2)
    expected = NearestNeighbors(n_neighbors=1).fit(training.numpy()).kneighbors(features.numpy())[0][:, 0]
    found = nearest_training_distance(features, training)
    assert found.shape == (30,)
    torch.testing.assert_close(found, torch.from_numpy(expected), rtol=1e-9, atol=0)
    order = torch.randperm(80, generator=torch.Generator().manual_seed(0))
    turned = nearest_training_distance(features @ turn(6), training[order] @ turn(6))
    torch.testing.assert_close(turned, found, rtol=1e-9, atol=0)


def test_a_copy_is_at_zero_however_far_the_features_are_from_the_origin() -> None:
    training = samples(2500, 4, 1) + 1e4
    found = nearest_training_distance(torch.cat([training[::2], training[:1] + 1e3]), training)
    assert found[:-1].unique().tolist() == [0.0]
    assert found[-1] > 100


def test_there_must_be_clips_of_one_width() -> None:
    with pytest.raises(ValueError, match="at least 1 sample"):
        nearest_training_distance(torch.zeros(3, 2), torch.zeros(0, 2))
    with pytest.raises(ValueError, match="equal width"):
        nearest_training_distance(torch.zeros(3, 2), torch.zeros(3, 4))
