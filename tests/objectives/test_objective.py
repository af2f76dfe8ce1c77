from __future__ import annotations

import pytest
import torch

from motiongen.contracts import Posterior, Prediction
from motiongen.generation.schedules import LinearRamp
from motiongen.objectives.objective import Objective
from motiongen.objectives.quantities import local_joints, rotation, translation
from motiongen.objectives.terms import kl_to_standard_normal, squared_error, velocity_error
from tests.compositions import batch, skeleton


def first_two(features, skeleton):
    return features[..., :2]


def objective(**changes):
    options = {
        "quantities": {"pose": first_two},
        "weights": {"pose": 3.0, "kl": 0.01},
        "velocity": 2.0,
        "first_pass": 0.1,
        "last_pass": 0.9,
    }
    return Objective(**(options | changes))


def test_equation_1_by_hand():
    """Errors (1, 0), (0, 2), (2, 2) of three frames; their differences are (-1, 2), (2, 0)."""
    data = batch((3,))
    error = torch.zeros_like(data.motion)
    error[0, :, :2] = torch.tensor([[1.0, 0.0], [0.0, 2.0], [2.0, 2.0]])
    loss = objective()
    terms = loss.terms(Prediction(data.motion + error), data, skeleton())
    mean_square = (1 / 2 + 4 / 2 + 8 / 2) / 3
    velocity = (5 / 2 + 4 / 2) / 2
    assert terms["pose"].item() == pytest.approx(mean_square, rel=1e-5)
    assert terms["pose_velocity"].item() == pytest.approx(velocity, rel=1e-5)
    assert loss.total(terms, 0.5).item() == pytest.approx(3 * (mean_square + 2 * velocity), rel=1e-5)


def test_equation_2_by_hand():
    """First pass off by 1 everywhere, last pass off by 2; posterior N(1, 1) in 4 dimensions."""
    data = batch((3, 2))
    posterior = Posterior(torch.ones(2, 4), torch.zeros(2, 4))
    loss = objective()
    prediction = Prediction(data.motion + 2, posterior, first_pass=data.motion + 1)
    terms = loss.terms(prediction, data, skeleton())
    assert set(terms) == {"pose", "pose_velocity", "first_pass/pose", "first_pass/pose_velocity", "kl"}
    assert terms["kl"].item() == pytest.approx(2.0)
    assert loss.total(terms, 0.5).item() == pytest.approx(0.1 * 3 * 1 + 0.9 * 3 * 4 + 0.01 * 2.0, rel=1e-5)


def test_every_motion_counts_the_same_whatever_its_length():
    mask = torch.tensor([[True, True, True, True], [True, False, False, False]])
    predicted = torch.tensor([[[1.0]] * 4, [[3.0]] * 4])
    assert squared_error(predicted, torch.zeros_like(predicted), mask).item() == pytest.approx((1 + 9) / 2)


def test_padding_does_not_enter():
    data = batch((5, 3), frames=9)
    prediction = Prediction(data.motion + 1)
    dirty = Prediction(data.motion + 1 + 50 * (~data.condition.mask).unsqueeze(-1))
    loss = objective()
    for name, value in loss.terms(prediction, data, skeleton()).items():
        torch.testing.assert_close(loss.terms(dirty, data, skeleton())[name], value)


def test_motion_of_one_frame_has_no_velocity_error():
    data = batch((1,))
    assert velocity_error(data.motion + 1, data.motion, data.condition.mask).item() == 0


def test_kl_closed_form():
    posterior = Posterior(torch.tensor([[0.5, -1.0]]), torch.tensor([[0.0, 0.7]]))
    normal = torch.distributions.Normal
    expected = torch.distributions.kl_divergence(
        normal(posterior.mean, (0.5 * posterior.log_variance).exp()), normal(torch.zeros(2), torch.ones(2))
    ).sum()
    torch.testing.assert_close(kl_to_standard_normal(posterior), expected)


def test_every_quantity_needs_a_weight():
    with pytest.raises(ValueError, match=r"objective.weights lacks pose$"):
        objective(weights={"poze": 1.0, "kl": 1.0})


def test_a_weight_of_no_term_is_refused():
    data = batch((4,))
    loss = objective(weights={"pose": 1.0, "kl": 1.0, "unit_norm": 1.0})
    with pytest.raises(ValueError, match=r"objective.weights names unit_norm, which this generator does not give"):
        loss.total(loss.terms(Prediction(data.motion), data, skeleton()), 0.5)


def test_a_generators_own_terms_are_weighted_and_need_a_weight():
    data = batch((4,))
    prediction = Prediction(data.motion, terms={"unit_norm": torch.tensor(5.0)})
    loss = objective(weights={"pose": 1.0, "kl": 1.0, "unit_norm": 0.3})
    assert loss.total(loss.terms(prediction, data, skeleton()), 0.5).item() == pytest.approx(1.5)
    with pytest.raises(ValueError, match=r"objective\.weights lacks unit_norm"):
        objective().total(loss.terms(prediction, data, skeleton()), 0.5)


def test_a_ramp_changes_its_weight_over_the_run():
    data = batch((4,))
    loss = objective(ramps={"kl": LinearRamp(0.0, 0.5)})
    terms = loss.terms(Prediction(data.motion, Posterior(torch.ones(1, 4), torch.zeros(1, 4))), data, skeleton())
    totals = [loss.total(terms, progress).item() for progress in (0.0, 0.25, 0.5, 1.0)]
    assert totals == pytest.approx([0.0, 0.01, 0.02, 0.02])
    with pytest.raises(ValueError, match=r"objective\.ramps names klx, which objective.weights does not"):
        objective(ramps={"klx": LinearRamp(0.0, 0.5)})


def test_quantities_take_what_they_name():
    features = batch((4,)).motion
    assert rotation(features, skeleton()).shape == (1, 4, 132)
    assert torch.equal(translation(features, skeleton()), features[..., 132:])
    moved = features.clone()
    moved[..., 132:] += 5
    torch.testing.assert_close(local_joints(features, skeleton()), local_joints(moved, skeleton()))
