"""What every registered recognizer has to do, whoever wrote it, at the sizes that its option states."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import torch
from hydra.utils import instantiate
from omegaconf import DictConfig

from motiongen.configuration import compose
from motiongen.discovery import CORE, options
from motiongen.motion.representation import FEATURES
from motiongen.motion.skeleton import JOINTS, Skeleton
from motiongen.options_check import problems_in
from motiongen.recognition.recognizer import Recognizer, RecognizerOutput
from motiongen.recognition.training import recognized_share, train
from tests.recognition.corpus import three_actions

TAGS = 5
LENGTHS = (20, 13, 1)
OFFERED = [option for option in options() if option.group == "recognizer"]
every_recognizer = pytest.mark.parametrize("name", [option.name for option in OFFERED])


def settings(name: str) -> DictConfig:
    config = compose([f"recognizer={name}", "scale=smoke"])
    assert problems_in(config, ["recognizer"]) == []
    return config.recognizer


def recognizer(name: str, seed: int = 0) -> Recognizer:
    """With weights from a seed, in eval mode."""
    offsets = torch.randn(JOINTS, 3, generator=torch.Generator().manual_seed(1)) * 0.2
    offsets[0] = 0
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return instantiate(settings(name).network)(tags=TAGS, skeleton=Skeleton(offsets)).eval()


def clips(*lengths: int, padding: float = 0.0, frames: int | None = None) -> tuple[torch.Tensor, torch.Tensor]:
    """Motion (B, T, 135) of the lengths, `padding` behind, and its mask (B, T); a clip is the same in any batch."""
    motion = torch.full((len(lengths), frames or max(lengths), FEATURES), padding)
    for row, length in enumerate(lengths):
        motion[row, :length] = torch.randn(length, FEATURES, generator=torch.Generator().manual_seed(length))
    return motion, torch.arange(motion.shape[1]) < torch.tensor(lengths).unsqueeze(1)


def assert_same(found: RecognizerOutput, expected: RecognizerOutput) -> None:
    torch.testing.assert_close(found.logits, expected.logits, atol=2e-5, rtol=2e-5)
    torch.testing.assert_close(found.features, expected.features, atol=2e-5, rtol=2e-5)


def test_no_recognizer_imports_generator_code() -> None:
    modules = [settings(option.name).network._target_.rpartition(".")[0] for option in OFFERED]
    program = (
        f"import sys, {', '.join(modules)}; "
        "print([name for name in sys.modules if name.startswith(('motiongen.generation', 'motiongen_plugins'))])"
    )
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"


@every_recognizer
@torch.no_grad()
def test_judges_clips_of_any_length(name: str) -> None:
    network = recognizer(name)
    shapes = set()
    for length in (1, 5, 20):
        seen = network(*clips(length, length))
        assert seen.logits.shape == (2, TAGS)
        assert seen.logits.isfinite().all()
        assert seen.features.isfinite().all()
        shapes.add(seen.features.shape)
    assert len(shapes) == 1


@torch.no_grad()
def test_built_in_recognizers_measure_in_equally_many_dimensions() -> None:
    """So that the FIDs of all need equally many clips."""
    built_in = [option.name for option in OFFERED if option.plugin == CORE]
    assert {name: recognizer(name)(*clips(5)).features.shape[1] for name in built_in} == dict.fromkeys(built_in, 64)


@every_recognizer
@pytest.mark.parametrize("padding", [0.0, 1e6, float("nan")])
@torch.no_grad()
def test_padding_changes_nothing_whatever_it_holds(name: str, padding: float) -> None:
    network = recognizer(name)
    assert_same(network(*clips(*LENGTHS, padding=padding, frames=27)), network(*clips(*LENGTHS)))


@every_recognizer
@torch.no_grad()
def test_a_clip_is_judged_the_same_alone_and_in_a_batch(name: str) -> None:
    network = recognizer(name)
    together = network(*clips(*LENGTHS))
    for row, length in enumerate(LENGTHS):
        assert_same(
            RecognizerOutput(together.logits[row : row + 1], together.features[row : row + 1]), network(*clips(length))
        )


@every_recognizer
@torch.no_grad()
def test_the_same_motion_gives_the_same_answer_twice(name: str) -> None:
    network = recognizer(name)
    first, again = (network(*clips(*LENGTHS)) for _ in range(2))
    assert torch.equal(first.logits, again.logits)
    assert torch.equal(first.features, again.features)


@every_recognizer
@pytest.mark.parametrize("padding", [0.0, float("nan")])
def test_gradients_reach_every_parameter_and_no_padded_frame(name: str, padding: float) -> None:
    network = recognizer(name).train()
    motion, mask = clips(*LENGTHS, padding=padding)
    motion.requires_grad_()
    network(motion, mask).logits.square().sum().backward()
    assert motion.grad is not None
    assert motion.grad.isfinite().all()
    assert (motion.grad[~mask] == 0).all()
    gradients = {name: parameter.grad for name, parameter in network.named_parameters()}
    assert [name for name, gradient in gradients.items() if gradient is None or not gradient.any()] == []
    assert all(gradient.isfinite().all() for gradient in gradients.values() if gradient is not None)


@every_recognizer
def test_saved_and_loaded_it_judges_the_same(name: str, tmp_path: Path) -> None:
    network, other = recognizer(name), recognizer(name, seed=1)
    network.train()(*clips(*LENGTHS))  # what is gathered while training is saved too
    torch.save(network.eval().state_dict(), tmp_path / "weights.pt")
    other.load_state_dict(torch.load(tmp_path / "weights.pt", weights_only=True))
    with torch.no_grad():
        assert torch.equal(other(*clips(*LENGTHS)).features, network(*clips(*LENGTHS)).features)


@every_recognizer
def test_learns_to_tell_three_actions_apart(name: str, tmp_path: Path) -> None:
    data, config = three_actions(tmp_path), settings(name)
    training = instantiate(config.training, epochs=20, batch_size=8, epoch_steps=4)
    learned = train(instantiate(config.network), training, data)
    assert not learned.training
    assert recognized_share(learned, data.test_batches(8)) >= 0.9
