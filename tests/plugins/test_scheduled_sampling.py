from __future__ import annotations

import pytest
import torch

from motiongen.contracts import Code
from motiongen_plugins.scheduled_sampling.scheduled_sampling import ScheduledSampling
from motiongen_plugins.teacher_forcing.teacher_forcing import TeacherForcing
from tests.compositions import batch, marionet


def predict(scheme, data, progress):
    generator = marionet(scheme).eval()
    with torch.no_grad():
        return generator, generator.reconstruct(data, progress, torch.Generator().manual_seed(1))


def test_before_activation_it_is_teacher_forcing():
    data = batch((9, 6))
    _, forced = predict(TeacherForcing(), data, 0.2)
    _, scheduled = predict(ScheduledSampling(activate=0.25, accomplish=0.75), data, 0.2)
    assert scheduled.first_pass is None
    assert torch.equal(scheduled.motion, forced.motion)


def test_ratio_0_repeats_teacher_forcing():
    data = batch((9, 6))
    _, forced = predict(TeacherForcing(), data, 0.25)
    _, scheduled = predict(ScheduledSampling(activate=0.25, accomplish=0.75), data, 0.25)
    assert torch.equal(scheduled.first_pass, forced.motion)
    assert torch.equal(scheduled.motion, forced.motion)


def test_ratio_1_feeds_the_whole_first_pass_back():
    data = batch((9, 6))
    generator, scheduled = predict(ScheduledSampling(activate=0.25, accomplish=0.75), data, 0.75)
    seeded = torch.Generator().manual_seed(1)
    with torch.no_grad():
        latent = generator.encoder.posterior(data).sample(seeded)
        controls = generator.unroller(Code(latent, latent), data.condition)
        past = torch.cat([data.condition.initial_motion[:, -1:], scheduled.first_pass[:, :-1]], dim=1)
        expected = generator.decoder(controls, data.condition, past)
    assert torch.equal(scheduled.motion, expected)


def test_half_way_about_half_of_the_frames_are_predicted():
    """A decoder that keeps what it was shown: the first pass sees truth (0) and predicts 1, the second sees the mix."""

    class Echo:
        autoregressive = True

        def __call__(self, controls, condition, past):
            self.seen = past
            return torch.ones_like(past)

    data = batch((200,) * 4)
    data = type(data)(torch.zeros_like(data.motion), data.condition)
    decoder = Echo()
    scheme = ScheduledSampling(activate=0.0, accomplish=1.0)
    scheme(decoder, None, data, 0.5, torch.Generator().manual_seed(0))
    mixed = decoder.seen[:, 1:]
    assert ((mixed == 0).all(-1) | (mixed == 1).all(-1)).all()
    assert 0.45 < (mixed[..., 0] == 1).float().mean() < 0.55
    assert torch.equal(decoder.seen[:, 0], data.condition.initial_motion[:, -1])


def test_a_rollout_feeds_the_free_running_motion_back():
    data = batch((6, 4))
    generator, scheduled = predict(ScheduledSampling(activate=0.0, accomplish=0.5, rollouts=1.0), data, 1.0)
    free = generator.generate(data.condition, seed=1)
    mask = data.condition.mask
    # Fed its own motion, a decoder predicts it again.
    torch.testing.assert_close(scheduled.motion[mask], free[mask], atol=1e-5, rtol=1e-5)


def test_rollouts_become_as_frequent_as_asked_for():
    class Counts:
        rollouts = 0

        def __call__(self, controls, condition, past):
            return past

        def generate(self, controls, condition):
            self.rollouts += 1
            return torch.zeros(*condition.mask.shape, 135)

    decoder, data, draws = Counts(), batch((3,)), torch.Generator().manual_seed(0)
    scheme = ScheduledSampling(activate=0.25, accomplish=0.75, rollouts=0.6)
    counts = {}
    for progress in (0.25, 0.5, 0.75):
        decoder.rollouts = 0
        for _ in range(400):
            scheme(decoder, None, data, progress, draws)
        counts[progress] = decoder.rollouts / 400
    assert counts == {0.25: 0.0, 0.5: pytest.approx(0.3, abs=0.05), 0.75: pytest.approx(0.6, abs=0.05)}
