from __future__ import annotations

import pytest
import torch
from hydra.utils import instantiate
from torch import nn

from motiongen.configuration import compose
from motiongen.contracts import GeneratorModule
from motiongen.recognition.recognizer import Recognizer, RecognizerOutput
from motiongen.synthesis.correction import Continued, Uncorrected
from motiongen_plugins.action_revision.action_revision import ActionRevision
from motiongen_plugins.shadow_start.shadow_start import ShadowStart
from tests.compositions import TAGS, batch


class Numbered(GeneratorModule):
    """Every frame holds the seed."""

    def generate(self, condition, seed):
        return torch.full((*condition.mask.shape, 135), float(seed))


class Odd(Recognizer):
    """Recognizes the actions of odd rows at the first look."""

    def __init__(self):
        super().__init__()
        self.looks = 0
        self.tags = nn.Parameter(torch.zeros(0))

    def forward(self, motion, mask):
        self.looks += 1
        logits = torch.zeros(len(motion), TAGS)
        rows = torch.arange(len(motion))
        logits[rows, torch.where(rows % 2 == 1, rows % TAGS, (rows + 1) % TAGS)] = 1
        return RecognizerOutput(logits, motion[:, 0])


class Marked:
    asks_recognizer = False

    def __init__(self):
        self.asked = None

    def __call__(self, generator, condition, seed, recognizer):
        self.asked = condition, seed
        return Continued(torch.full((*condition.mask.shape, 135), -1.0), torch.ones(len(condition.tags), dtype=bool))


def test_only_actions_that_are_taken_for_others_are_made_again_and_once():
    retry, recognizer, condition = Marked(), Odd(), batch((5, 5, 5, 5)).condition
    made = ActionRevision(retry=retry)(Numbered(), condition, 7, recognizer)
    assert made.motion[:, 0, 0].tolist() == [-1.0, 7.0, -1.0, 7.0]
    assert made.jumps.tolist() == [True, False, True, False]
    asked, seed = retry.asked
    assert torch.equal(asked.tags, condition.tags[[0, 2]])
    assert torch.equal(asked.trajectory, condition.trajectory[[0, 2]])
    assert seed != 7
    assert recognizer.looks == 1


def test_where_all_are_recognized_nothing_is_made_again():
    condition = batch((5, 5)).condition.rows(torch.tensor([1]))

    class Knows(Odd):
        def forward(self, motion, mask):
            return RecognizerOutput(condition.tags, motion[:, 0])

    retry = Marked()
    made = ActionRevision(retry=retry)(Numbered(), condition, 7, Knows())
    assert retry.asked is None
    assert not made.jumps.any()


def test_without_a_recognizer_it_says_so():
    with pytest.raises(ValueError, match="needs a recognizer"):
        ActionRevision(retry=Uncorrected())(Numbered(), batch((5,)).condition, 0, None)


def test_the_second_attempt_is_the_papers_by_default_and_can_be_another():
    revision = instantiate(compose(["correction=action_revision"]).correction)
    assert isinstance(revision, ActionRevision)
    assert isinstance(revision.retry, ShadowStart)
    plain = compose(["correction=action_revision", "correction.retry.normalize=false"])
    assert not instantiate(plain.correction).retry.normalize
    again = instantiate(compose(["correction=action_revision", "correction@correction.retry=none"]).correction)
    assert isinstance(again.retry, Uncorrected)
