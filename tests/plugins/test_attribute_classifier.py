from __future__ import annotations

import pytest
import torch

from motiongen_plugins.attribute_classifier.attribute_classifier import AttributeClassifier


def classifier(kernel: int = 5) -> AttributeClassifier:
    torch.manual_seed(0)
    return AttributeClassifier(6, 4, layers=3, width=8, kernel=kernel)


def test_padding_and_what_it_holds_change_nothing():
    network, poses = classifier(), torch.randn(1, 9, 6)
    logits, features = network(poses, torch.ones(1, 9, dtype=torch.bool))
    longer = torch.cat([poses, 100 * torch.randn(1, 11, 6)], dim=1)
    padded, maps = network(longer, torch.arange(20).unsqueeze(0) < 9)
    torch.testing.assert_close(logits, padded)
    for one, other in zip(features, maps, strict=True):
        torch.testing.assert_close(one, other[:, :9])
        assert (other[:, 9:] == 0).all()


def test_a_motion_of_one_frame_is_classified():
    logits, _ = classifier()(torch.randn(2, 1, 6), torch.ones(2, 1, dtype=torch.bool))
    assert logits.shape == (2, 4)
    assert logits.isfinite().all()


def test_it_learns_what_only_the_order_of_frames_tells():
    """Rising against falling ramps: their frames, taken one by one, are the same."""
    network = classifier()
    optimizer = torch.optim.Adam(network.parameters(), lr=0.005)
    ramp = torch.linspace(-1, 1, 12).unsqueeze(1)
    poses = torch.stack([ramp, -ramp] * 8).expand(-1, -1, 6)
    labels, mask = torch.tensor([0, 1] * 8), torch.ones(16, 12, dtype=torch.bool)
    for _ in range(60):
        optimizer.zero_grad()
        torch.nn.functional.cross_entropy(network(poses, mask)[0], labels).backward()
        optimizer.step()
    assert (network(poses, mask)[0].argmax(dim=1) == labels).all()


def test_an_even_kernel_is_refused():
    with pytest.raises(ValueError, match=r"generator\.classifier\.kernel is odd, not 4"):
        classifier(kernel=4)
