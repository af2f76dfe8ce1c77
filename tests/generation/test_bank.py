from __future__ import annotations

import torch

from motiongen.generation.bank import TaggedBank, jaccard


def test_jaccard():
    tags, others = torch.tensor([[1.0, 1, 0, 0], [0, 0, 0, 0]]), torch.tensor([[1.0, 0, 1, 1], [1, 1, 0, 0]])
    torch.testing.assert_close(jaccard(tags, others), torch.tensor([[0.25, 1.0], [0.0, 0.0]]))


def test_the_likest_entries_are_those_with_the_most_tags_in_common():
    bank = TaggedBank(3, 2)
    bank.fill(torch.tensor([[1.0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]]), torch.zeros(4, 2))
    wanted = torch.tensor([[1.0, 0, 0], [1, 1, 0], [0, 0, 1]])
    assert bank.likest(wanted).tolist() == [
        [True, False, True, False],
        [False, True, False, False],
        [False, False, False, False],
    ]


def test_loading_brings_as_many_entries_as_were_saved():
    full, empty = TaggedBank(3, 2), TaggedBank(3, 2)
    full.fill(torch.eye(3)[[0, 2]], torch.randn(2, 2))
    empty.load_state_dict(full.state_dict())
    assert len(empty) == 2
    assert torch.equal(empty.entries, full.entries)
