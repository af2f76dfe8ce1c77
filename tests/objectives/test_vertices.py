"""The factored vertex error against skinning every vertex."""

from __future__ import annotations

import shutil
from dataclasses import replace

import pytest
import roma
import torch
from hydra.utils import instantiate
from omegaconf import OmegaConf
from torch import Tensor

from motiongen.contracts import CompositionError, Prediction
from motiongen.motion.bodies import Body, makehuman, smpl
from motiongen.motion.representation import TRANSLATION, pack, unpack
from motiongen.motion.skeleton import JOINTS, Skeleton
from motiongen.objectives import direct_skinning
from motiongen.objectives.objective import Objective
from motiongen.objectives.terms import squared_error, velocity_error
from motiongen.objectives.vertices import DirectSkinning, Vertices, vertex_factor
from tests.compositions import batch, skeleton
from tests.motion.bodies.test_smpl import model, write


@pytest.fixture(scope="module", params=["makehuman", "smpl"])
def body(request, tmp_path_factory) -> Body:
    if request.param == "makehuman":
        return makehuman()
    return smpl(write(tmp_path_factory.mktemp("body") / "model.npz", model(24)))


def motion(seed: int, length: int = 6) -> Tensor:
    generator = torch.Generator().manual_seed(seed)
    rotations = roma.rotvec_to_rotmat(0.5 * torch.randn(2, length, JOINTS, 3, generator=generator))
    return pack(rotations, torch.randn(2, length, 3, generator=generator))


def skinned(body: Body, features: Tensor) -> Tensor:
    """All vertices relative to the pelvis, (B, T, 3V)."""
    rotations, position = unpack(features)
    return body.vertices(rotations, torch.zeros_like(position)).flatten(-2)


@pytest.mark.parametrize("error", [squared_error, velocity_error])
def test_loss_and_gradient_equal_direct_skinning(body: Body, error) -> None:
    rigid = replace(body, pose_directions=None)
    quantity = Vertices(body=body)
    mask = torch.tensor([[True] * 6, [True] * 4 + [False] * 2])
    found = []
    for measure in (lambda features: quantity(features, body.skeleton), lambda features: skinned(rigid, features)):
        predicted = motion(0).requires_grad_()
        loss = error(measure(predicted), measure(motion(1)), mask)
        found.append((loss, *torch.autograd.grad(loss, predicted)))
    (loss, gradient), (expected, expected_gradient) = found
    assert loss.item() == pytest.approx(expected.item(), rel=1e-5)
    assert (gradient - expected_gradient).norm() < 1e-5 * expected_gradient.norm()


def test_the_body_is_fitted_to_the_skeleton_of_the_data() -> None:
    offsets = makehuman().skeleton.offsets.clone()
    offsets[1:] *= torch.tensor([1.0, 1.2, 1.1])
    taller = Skeleton(offsets)
    quantity = Vertices(body=makehuman())
    fitted = makehuman().fitted_to(taller)
    for one in (makehuman().skeleton, taller):  # one after the other: each skeleton has a factor of its own
        quantity(motion(0), one)
    found = (quantity(motion(0), taller) - quantity(motion(1), taller)).square().mean()
    expected = (skinned(fitted, motion(0)) - skinned(fitted, motion(1))).square().mean()
    torch.testing.assert_close(found, expected, rtol=1e-5, atol=0)


def test_a_first_step_in_bfloat16_does_not_blur_the_body() -> None:
    taller = Skeleton(1.1 * makehuman().skeleton.offsets)
    first, plain = Vertices(body=makehuman()), Vertices(body=makehuman())
    with torch.autocast("cpu", dtype=torch.bfloat16):
        first(motion(0), taller)
    assert torch.equal(first(motion(0), taller), plain(motion(0), taller))


def test_few_numbers_stand_in_for_all_vertices() -> None:
    assert Vertices(body=makehuman())(motion(0), makehuman().skeleton).shape == (2, 6, 3 * 4 * JOINTS)


def test_what_moves_no_vertex_is_left_out(tmp_path) -> None:
    standin = smpl(write(tmp_path / "model.npz", model(24)))
    assert vertex_factor(standin).shape == (4 * JOINTS, len(standin.rest))
    body = makehuman()
    stiff = replace(body, weights=torch.eye(JOINTS)[[3]].expand(len(body.rest), -1))
    assert vertex_factor(stiff).shape == (4 * JOINTS, 4)


def test_the_pelvis_is_the_origin_unless_translation_counts() -> None:
    body = makehuman()
    moved = motion(0)
    moved[..., TRANSLATION] += torch.tensor([0.3, 0.0, -0.6])
    local, world = Vertices(body=body), Vertices(body=body, translation=True)
    assert torch.equal(local(moved, body.skeleton), local(motion(0), body.skeleton))
    error = (world(moved, body.skeleton) - world(motion(0), body.skeleton)).square().mean()
    assert error.item() == pytest.approx((0.09 + 0.36) / 3, rel=1e-4)


def test_correctives_take_the_direct_path(tmp_path) -> None:
    body = smpl(write(tmp_path / "model.npz", model(24)))
    direct = Vertices(body=body, correctives=True)(motion(0), body.skeleton)
    torch.testing.assert_close(direct, skinned(body, motion(0)), atol=1e-5, rtol=1e-5)
    assert not torch.allclose(direct, skinned(replace(body, pose_directions=None), motion(0)), atol=1e-2)


@pytest.mark.skipif(shutil.which("g++") is None, reason="torch.compile needs a C++ compiler, and there is no g++")
def test_compiled_is_what_it_is_without() -> None:
    body = makehuman()
    found = []
    for compiled in (False, True):
        quantity = Vertices(body=body, compiled=compiled)
        for length in (5, 6):  # a second length is compiled for as well
            predicted = motion(0, length).requires_grad_()
            loss = (quantity(predicted, body.skeleton) - quantity(motion(1, length), body.skeleton)).square().mean()
            found.append(torch.cat([loss.detach()[None], torch.autograd.grad(loss, predicted)[0].flatten()]))
    for plain, other in zip(found[:2], found[2:], strict=True):
        assert (other - plain).norm() < 1e-5 * plain.norm()


def test_compiling_what_cannot_be_is_refused(monkeypatch, tmp_path) -> None:
    body = smpl(write(tmp_path / "model.npz", model(24)))
    with pytest.raises(CompositionError, match="compiled=true is for rigid skinning"):
        Vertices(body=body, correctives=True, compiled=True)
    monkeypatch.setenv("CXX", str(tmp_path / "none"))
    with pytest.raises(CompositionError, match=r"compiled=true needs a C\+\+ compiler, and there is no .*none"):
        Vertices(body=body, compiled=True)


def test_correctives_that_a_body_has_not_are_refused() -> None:
    with pytest.raises(CompositionError, match=r"correctives=true would have no effect.*body=smpl"):
        Vertices(body=makehuman(), correctives=True)


def test_an_objective_names_it_with_the_body_of_the_run() -> None:
    config = OmegaConf.create(
        {
            "body": {"_target_": "motiongen.motion.bodies.makehuman"},
            "objective": {
                "_target_": "motiongen.objectives.objective.Objective",
                "quantities": {"vertices": {"_target_": "motiongen.objectives.vertices.Vertices", "body": "${body}"}},
                "weights": {"vertices": 1.0, "kl": 0.0},
                "velocity": 1.0,
                "first_pass": 0.1,
                "last_pass": 0.9,
            },
        }
    )
    objective: Objective = instantiate(config.objective)
    data = batch((5, 3), frames=8)  # padded frames are zeros, which are no poses
    predicted = (data.motion + 0.1).requires_grad_()
    terms = objective.terms(Prediction(predicted), data, skeleton())
    objective.total(terms, 0.0).backward()
    assert set(terms) == {"vertices", "vertices_velocity"}
    assert predicted.grad.isfinite().all()
    assert (predicted.grad[1, 3:] == 0).all()


@pytest.mark.parametrize("together", [1, 700, direct_skinning.TOGETHER])
def test_direct_skinning_part_by_part_is_skinning_at_once(body: Body, monkeypatch, together: int) -> None:
    monkeypatch.setattr(direct_skinning, "TOGETHER", together)
    features = motion(0, length=3)
    rotations, position = unpack(features)
    found = DirectSkinning(body)(rotations, position)
    torch.testing.assert_close(found, body.vertices(rotations, position).flatten(-2))
