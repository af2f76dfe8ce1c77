from collections.abc import Iterator

import pytest
import torch

from motiongen.motion.canonical import GroundFrame
from motiongen.motion.representation import FEATURES
from motiongen.motion.skeleton import JOINTS, Skeleton
from motiongen.recognition.recognizer import Recognizer
from motiongen.recognition.signals import SIGNALS, body_signals
from motiongen.recognition.transformer import TransformerRecognizer


@pytest.fixture
def skeleton() -> Skeleton:
    offsets = torch.randn(JOINTS, 3, generator=torch.Generator().manual_seed(1)) * 0.2
    offsets[0] = 0
    return Skeleton(offsets)


@pytest.fixture
def network(skeleton: Skeleton) -> Iterator[Recognizer]:
    with torch.random.fork_rng():
        torch.manual_seed(0)
        yield TransformerRecognizer(tags=5, skeleton=skeleton, width=16, heads=2, feature_width=6).eval()


@pytest.fixture
def motion() -> torch.Tensor:
    return torch.randn(3, 12, FEATURES, generator=torch.Generator().manual_seed(2))


@pytest.mark.parametrize("padding", [0.0, 1e6, float("nan")])
def test_padding_changes_nothing_whatever_it_holds(network: Recognizer, motion: torch.Tensor, padding: float) -> None:
    longer = torch.cat([motion, torch.full((3, 8, FEATURES), padding)], dim=1)
    mask = torch.arange(20).expand(3, 20) < 12
    with torch.no_grad():
        alone, padded = network(motion, mask[:, :12]), network(longer, mask)
    torch.testing.assert_close(padded.logits, alone.logits, atol=1e-5, rtol=0)
    torch.testing.assert_close(padded.features, alone.features, atol=1e-5, rtol=0)


def test_a_clip_is_judged_the_same_alone_and_in_a_batch(network: Recognizer, motion: torch.Tensor) -> None:
    mask = torch.arange(12) < torch.tensor([[12], [7], [3]])
    with torch.no_grad():
        together = network(motion, mask).features
        for row, length in enumerate((12, 7, 3)):
            alone = network(motion[row : row + 1, :length], mask[row : row + 1, :length]).features
            torch.testing.assert_close(together[row : row + 1], alone, atol=1e-5, rtol=0)


def test_the_same_motion_gives_the_same_answer_twice(network: Recognizer, motion: torch.Tensor) -> None:
    mask = torch.ones(3, 12, dtype=torch.bool)
    assert torch.equal(network(motion, mask).logits, network(motion, mask).logits)


def test_zero_padding_leaves_gradients_finite(network: Recognizer, motion: torch.Tensor) -> None:
    mask = torch.arange(12) < torch.tensor([[12], [7], [3]])
    motion = (motion * mask.unsqueeze(-1)).requires_grad_()
    network.train()(motion, mask).logits.sum().backward()
    assert motion.grad is not None
    assert motion.grad.isfinite().all()
    assert (motion.grad[~mask] == 0).all()
    assert all(parameter.grad is not None and parameter.grad.any() for parameter in network.parameters())


def test_signals_do_not_depend_on_where_the_body_stands(skeleton: Skeleton, motion: torch.Tensor) -> None:
    mask = torch.ones(3, 12, dtype=torch.bool)
    moved = GroundFrame(torch.zeros(3), torch.tensor([[5.0, -3.0]]).expand(3, 2)).leave(motion)
    signals = body_signals(motion, mask, skeleton)
    assert signals.shape == (3, 12, SIGNALS)
    torch.testing.assert_close(body_signals(moved, mask, skeleton), signals, atol=1e-3, rtol=0)


def test_heads_must_divide_the_width(skeleton: Skeleton) -> None:
    with pytest.raises(ValueError, match="multiple of heads"):
        TransformerRecognizer(tags=5, skeleton=skeleton, width=10, heads=4)
