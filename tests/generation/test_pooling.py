from __future__ import annotations

import pytest
import torch

from motiongen.generation.pooling import masked_mean, segment_means


@pytest.mark.parametrize("length", [1, 3, 7, 8, 20])
def test_segment_means_are_the_means_of_equal_parts_whatever_stands_behind_the_length(length):
    tokens = torch.randn(1, 20, 5, generator=torch.Generator().manual_seed(0))
    mask = torch.arange(20).unsqueeze(0) < length
    expected = torch.zeros(4, 5)
    for part in range(4):
        inside = [frame for frame in range(length) if frame * 4 // length == part]
        if inside:
            expected[part] = tokens[0, inside].mean(dim=0)
    dirty = tokens.masked_fill(~mask.unsqueeze(-1), float("nan"))
    torch.testing.assert_close(segment_means(dirty, mask, 4), expected.view(1, 20))


def test_one_segment_is_the_masked_mean():
    tokens = torch.randn(3, 9, 5, generator=torch.Generator().manual_seed(0))
    mask = torch.arange(9) < torch.tensor([[9], [4], [0]])
    torch.testing.assert_close(segment_means(tokens, mask, 1), masked_mean(tokens, mask))
