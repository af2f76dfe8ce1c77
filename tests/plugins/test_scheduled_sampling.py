from __future__ import annotations

import pytest
import torch

from motiongen.contracts import Code, CompositionError
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


def test_further_passes_feed_back_what_was_predicted_from_predictions():
    """With a pass for every frame the last one is what the decoder generates by itself."""
    data = batch((5, 3))
    generator, scheduled = predict(ScheduledSampling(activate=0.0, accomplish=0.0, passes=6), data, 0.5)
    seeded = torch.Generator().manual_seed(1)
    with torch.no_grad():
        latent = generator.encoder.posterior(data).sample(seeded)
        controls = generator.unroller(Code(latent, latent), data.condition)
        generated = generator.decoder.generate(controls, data.condition)
    mask = data.condition.mask
    torch.testing.assert_close(scheduled.motion[mask], generated[mask])
    assert not torch.allclose(scheduled.first_pass[mask], generated[mask], atol=1e-3)


def test_one_pass_is_refused():
    with pytest.raises(CompositionError, match="teacher_forcing"):
        ScheduledSampling(activate=0.0, accomplish=1.0, passes=1)
