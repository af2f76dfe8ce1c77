"""The vertex error with correctives, in parts and estimated, against skinning every vertex at once."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from motiongen.contracts import CompositionError
from motiongen.motion.bodies import Body, makehuman, smpl
from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import Skeleton
from motiongen.objectives.corrected_vertices import CorrectedVertices
from motiongen.objectives.vertices import Vertices
from tests.motion.bodies.test_smpl import model, write
from tests.objectives.test_vertices import motion


@pytest.fixture
def body(tmp_path) -> Body:
    return smpl(write(tmp_path / "model.npz", model(24)))


def pair() -> tuple[Tensor, Tensor]:
    return motion(0).flatten(0, 1).requires_grad_(), motion(1).flatten(0, 1)


def plain(body: Body, predicted: Tensor, target: Tensor) -> Tensor:
    """(N,)"""
    one, other = (
        body.vertices(rotations, torch.zeros_like(place)) for rotations, place in map(unpack, (predicted, target))
    )
    return (one - other).square().mean(dim=(-1, -2))


@pytest.mark.parametrize("all_are_drawn", [False, True])
@pytest.mark.parametrize("stature", [1.0, 1.1])
def test_error_and_gradient_equal_skinning_at_once(body: Body, all_are_drawn: bool, stature: float) -> None:
    skeleton = Skeleton(stature * body.skeleton.offsets)
    distance = CorrectedVertices(body=body, sampled=len(body.rest) if all_are_drawn else None)
    predicted, target = pair()
    found, expected = distance(predicted, target, skeleton), plain(body.fitted_to(skeleton), predicted, target)
    torch.testing.assert_close(found, expected, rtol=1e-5, atol=0)
    gradient, true = (torch.autograd.grad(error.mean(), predicted)[0] for error in (found, expected))
    assert (gradient - true).norm() < 1e-5 * true.norm()


def test_it_is_the_error_of_the_quantity(body: Body) -> None:
    predicted, target = pair()
    quantity = Vertices(body=body, correctives=True)
    expected = (quantity(predicted, body.skeleton) - quantity(target, body.skeleton)).square().mean(dim=-1)
    torch.testing.assert_close(CorrectedVertices(body=body)(predicted, target, body.skeleton), expected)


def test_the_estimate_is_right_on_average_and_varies(body: Body) -> None:
    predicted, target = pair()
    exact = plain(body, predicted, target).mean()
    distance = CorrectedVertices(body=body, sampled=6, draws=torch.Generator().manual_seed(0))
    with torch.no_grad():
        errors = torch.stack([distance(predicted, target, body.skeleton).mean() for _ in range(600)])
    assert errors.std() > 1e-4 * exact
    assert (errors.mean() - exact).abs() < 4 * errors.std() / len(errors) ** 0.5


def test_one_seed_is_one_estimate(body: Body) -> None:
    predicted, target = pair()
    draws = [torch.Generator().manual_seed(seed) for seed in (3, 3, 4)]
    first, same, other = (
        CorrectedVertices(body=body, sampled=6, draws=each)(predicted, target, body.skeleton) for each in draws
    )
    assert torch.equal(first, same)
    assert not torch.equal(first, other)


def test_what_cannot_be_drawn_is_refused(body: Body) -> None:
    with pytest.raises(CompositionError, match="no pose-dependent correctives"):
        CorrectedVertices(body=makehuman())
    with pytest.raises(CompositionError, match=r"sampled=0, but the body has \d+ vertices"):
        CorrectedVertices(body=body, sampled=0)
