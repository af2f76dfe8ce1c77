from __future__ import annotations

import math

import pytest
import roma
import torch

from motiongen.contracts import Prediction
from motiongen.data.sources.builtin.body import MEAN
from motiongen.motion.representation import pack, unpack
from motiongen.motion.skeleton import JOINT, JOINTS
from motiongen.objectives.geodesic import (
    HierarchicalGeodesic,
    angle,
    cosine,
    impact_factors,
    matrix_angle,
    smaller_norm,
)
from motiongen.objectives.objective import Objective
from tests.compositions import batch, skeleton


@pytest.fixture
def quaternions():
    """Pairs of random rotations, the second in both signs; the last pair is nearly the same rotation."""
    torch.manual_seed(0)
    one, other = roma.random_unitquat(200), roma.random_unitquat(200)
    other[-1] = roma.quat_normalize(one[-1] + 1e-2 * torch.randn(4))
    return one, other * torch.tensor([1.0, -1.0]).repeat(100).unsqueeze(-1)


def test_angles_agree_with_roma(quaternions):
    one, other = quaternions
    expected = roma.unitquat_geodesic_distance(one, other)
    torch.testing.assert_close(angle(one, other), expected, atol=1e-4, rtol=1e-4)
    matrices = roma.unitquat_to_rotmat(one), roma.unitquat_to_rotmat(other)
    torch.testing.assert_close(matrix_angle(*matrices), expected, atol=1e-3, rtol=1e-4)
    torch.testing.assert_close(roma.rotmat_geodesic_distance(*matrices), expected, atol=1e-4, rtol=1e-4)


def test_approximate_forms_are_functions_of_the_angle(quaternions):
    expected = 1 - (roma.unitquat_geodesic_distance(*quaternions) / 2).cos()
    torch.testing.assert_close(cosine(*quaternions), expected, atol=1e-6, rtol=1e-5)
    torch.testing.assert_close(smaller_norm(*quaternions), 2 * expected, atol=1e-6, rtol=1e-5)


@pytest.mark.parametrize("form", ["angle", "cosine", "norm", "matrix"])
def test_gradients_are_finite_at_the_same_and_at_the_opposite_rotation(form):
    rotations = torch.eye(3).repeat(2, JOINTS, 1, 1)
    turned = torch.stack([rotations[0], roma.rotvec_to_rotmat(torch.tensor([math.pi, 0.0, 0.0])).expand(JOINTS, 3, 3)])
    predicted = pack(turned, torch.zeros(2, 3)).requires_grad_()
    HierarchicalGeodesic(form=form)(predicted, pack(rotations, torch.zeros(2, 3)), skeleton()).sum().backward()
    assert predicted.grad.isfinite().all()


def test_equation_23_by_hand_for_three_joints():
    """The built-in body: the knee carries shank and foot; spine3 collar, shoulder and arm; the hip the whole leg."""
    alpha = impact_factors(MEAN.skeleton())
    shank, foot = math.hypot(0.417, 0.035), math.hypot(0.052, 0.135)
    collar, shoulder = math.hypot(0.060, 0.135, 0.036), math.hypot(0.112, 0.035, 0.010)
    assert alpha[JOINT["left_knee"]].item() == pytest.approx(shank + foot, rel=1e-5)
    assert alpha[JOINT["spine3"]].item() == pytest.approx(collar + shoulder + 0.262 + 0.238, rel=1e-5)
    assert alpha[JOINT["right_hip"]].item() == pytest.approx(math.hypot(0.410, 0.020) + shank + foot, rel=1e-5)
    ends = [JOINT[name] for name in ("head", "left_wrist", "right_wrist", "left_foot", "right_foot")]
    assert (alpha == 0).nonzero().flatten().tolist() == sorted(ends)


def test_what_hangs_on_an_end_effector_lengthens_every_path_to_it():
    body = MEAN.skeleton()
    torch.testing.assert_close(impact_factors(body, 0.1), impact_factors(body) + 0.1)


def test_the_loss_weighs_each_joint_by_its_factor():
    """Only the left elbow is turned, by 0.3 radians, in the second of two frames."""
    rotations = roma.random_rotmat((2, JOINTS))
    turned = rotations.clone()
    turned[1, JOINT["left_elbow"]] @= roma.rotvec_to_rotmat(torch.tensor([0.0, 0.3, 0.0]))
    predicted, target = pack(turned, torch.zeros(2, 3)), pack(rotations, torch.zeros(2, 3))
    body = MEAN.skeleton()
    distance = HierarchicalGeodesic(end_effector=0.0)(predicted, target, body)
    # Unmoved joints count for the angle that the cosine is clamped to.
    assert distance[1].item() - distance[0].item() == pytest.approx(0.3 * 0.238, abs=1e-3)
    plain = HierarchicalGeodesic(hierarchical=False)(predicted, target, body)
    assert plain[1].item() - plain[0].item() == pytest.approx(0.3, abs=5e-3)


def test_the_pelvis_is_compared_only_where_it_is_asked_for():
    motion = batch((4,)).motion[0]
    turned, position = unpack(motion)
    turned = turned.clone()
    turned[:, 0] = roma.random_rotmat(4)
    other = pack(turned, position)
    assert HierarchicalGeodesic(form="cosine")(other, motion, skeleton()).abs().max() < 1e-4
    assert HierarchicalGeodesic(form="cosine", root=True)(other, motion, skeleton()).min() > 1e-3


def test_an_objective_averages_a_distance_over_valid_frames():
    """Eq. 2's shares and the padding rules hold for distances as for quantities; gradients stay finite."""

    def height_difference(predicted, target, skeleton):
        return (predicted - target)[:, -1].abs()

    data = batch((4, 2), frames=7)
    loss = Objective(
        quantities={},
        distances={"height": height_difference, "geodesic": HierarchicalGeodesic()},
        weights={"height": 3.0, "geodesic": 1.0, "kl": 0.0},
        velocity=2.0,
        first_pass=0.1,
        last_pass=0.9,
    )
    motion = data.motion + torch.randn(data.motion.shape)
    motion[..., -1] = data.motion[..., -1] + torch.tensor([[1.0], [2.0]])
    motion.requires_grad_()
    terms = loss.terms(Prediction(motion), data, skeleton())
    assert set(terms) == {"height", "geodesic"}
    assert terms["height"].item() == pytest.approx(1.5)
    terms["geodesic"].backward()
    assert motion.grad.isfinite().all()
    assert motion.grad[0, :4].abs().sum() > 0
    assert (motion.grad[1, 2:] == 0).all()
    two = loss.terms(Prediction(motion, first_pass=data.motion + 1), data, skeleton())
    without = {name: value for name, value in two.items() if "height" in name}
    assert loss.total(without | {"geodesic": torch.zeros(())}, 0.5).item() == pytest.approx(0.1 * 3 + 0.9 * 3 * 1.5)
