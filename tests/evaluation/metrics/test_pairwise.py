import pytest
import torch
from scipy.spatial.distance import cdist

from motiongen.evaluation.metrics.pairwise import BLOCK, distance_blocks, require_sets
from tests.evaluation.metrics.clouds import samples


@pytest.mark.parametrize("exact", [True, False])
def test_distances_are_scipy_s_in_blocks_that_stay_small(exact: bool) -> None:
    first, second = samples(2500, 3, 1), samples(2000, 3, 2)
    blocks = list(distance_blocks(first, second, exact=exact))
    assert len(blocks) > 1
    assert all(block.numel() <= BLOCK for block in blocks)
    expected = torch.from_numpy(cdist(first.numpy(), second.numpy()))
    torch.testing.assert_close(torch.cat(blocks), expected, rtol=1e-9, atol=1e-7)


def test_exact_distances_do_not_depend_on_block_or_order() -> None:
    first, second = samples(2500, 5, 1), samples(2000, 5, 1)
    found = torch.cat(list(distance_blocks(first, second, exact=True)))
    assert torch.equal(found.T, torch.cat(list(distance_blocks(second, first, exact=True))))
    rows = torch.cat([block for row in first[:20] for block in distance_blocks(row[None], second, exact=True)])
    assert torch.equal(found[:20], rows)
    itself = torch.cat(list(distance_blocks(first, first, exact=True)))
    assert itself.diagonal().unique().tolist() == [0.0]


def test_sets_that_cannot_be_compared_are_refused() -> None:
    require_sets("it", torch.zeros(2, 3), torch.zeros(4, 3), least=2)
    for first, second in [((1, 3), (4, 3)), ((2, 3), (4, 2)), ((2,), (2,)), ((2, 3, 1), (2, 3, 1))]:
        with pytest.raises(ValueError, match="it compares two sets of at least 2 samples"):
            require_sets("it", torch.zeros(first), torch.zeros(second), least=2)
