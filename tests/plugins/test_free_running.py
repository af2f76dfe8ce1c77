from __future__ import annotations

import pytest
import torch

from motiongen.configuration import check, compose
from motiongen.contracts import Code
from motiongen.errors import InputError
from motiongen_plugins.free_running.free_running import FreeRunning
from motiongen_plugins.teacher_forcing.teacher_forcing import TeacherForcing
from tests.compositions import batch, marionet


def predict(scheme, data, progress):
    generator = marionet(scheme).eval()
    with torch.no_grad():
        return generator, generator.reconstruct(data, progress, torch.Generator().manual_seed(1))


def test_before_activation_it_is_teacher_forcing():
    data = batch((9, 6))
    _, forced = predict(TeacherForcing(), data, 0.2)
    _, free = predict(FreeRunning(activate=0.25, accomplish=0.75), data, 0.2)
    assert free.first_pass is None
    assert torch.equal(free.motion, forced.motion)


def test_share_0_repeats_teacher_forcing():
    data = batch((9, 6))
    _, forced = predict(TeacherForcing(), data, 0.0)
    _, free = predict(FreeRunning(activate=0.0, accomplish=1.0), data, 0.0)
    assert torch.equal(free.first_pass, forced.motion)
    assert torch.equal(free.motion, forced.motion)


def test_share_1_gives_back_what_the_decoder_generates():
    """From its own motion the decoder predicts that motion again, frame for frame."""
    data = batch((9, 6))
    generator, free = predict(FreeRunning(activate=0.0, accomplish=1.0), data, 1.0)
    seeded = torch.Generator().manual_seed(1)
    with torch.no_grad():
        latent = generator.encoder.posterior(data).sample(seeded)
        controls = generator.unroller(Code(latent, latent), data.condition)
        generated = generator.decoder.generate(controls, data.condition)
    mask = data.condition.mask
    torch.testing.assert_close(free.motion[mask], generated[mask])
    assert not torch.allclose(free.first_pass[mask], generated[mask], atol=1e-3)


def test_half_way_about_half_of_the_motions_are_generated_and_whole():
    """A decoder that keeps what it was shown, and generates 1 where the truth is 0."""

    class Echo:
        autoregressive = True

        def __call__(self, controls, condition, past):
            self.seen = past
            return past

        def generate(self, controls, condition):
            return torch.ones(*condition.mask.shape, data.motion.shape[2])

    data = batch((5,) * 400)
    data = type(data)(torch.zeros_like(data.motion), data.condition)
    decoder = Echo()
    FreeRunning(activate=0.0, accomplish=1.0)(decoder, None, data, 0.5, torch.Generator().manual_seed(0))
    own = decoder.seen[:, 1:].flatten(1)
    assert ((own == 0).all(-1) | (own == 1).all(-1)).all()
    assert 0.4 < (own[:, 0] == 1).float().mean() < 0.6
    assert torch.equal(decoder.seen[:, 0], data.condition.initial_motion[:, -1])


def test_what_was_generated_enters_without_gradient():
    data = batch((9, 6))
    generator = marionet(FreeRunning(activate=0.0, accomplish=1.0)).train()
    prediction = generator.reconstruct(data, 1.0, torch.Generator().manual_seed(1))
    prediction.motion.square().sum().backward()
    for name, parameter in generator.decoder.transformer.named_parameters():
        assert parameter.grad is not None, name
        assert parameter.grad.isfinite().all()


def test_the_experiment_fine_tunes_a_run():
    with pytest.raises(InputError, match="init"):
        check(["+experiment=marionette_free_running"])


def test_its_composition_is_marionets_but_for_the_training_scheme():
    fine, plain = (compose([f"+experiment={name}"]) for name in ("marionette_free_running", "marionette"))
    assert fine.generator.training._target_.endswith(".FreeRunning")
    fine.generator.training = plain.generator.training
    for key in ("generator", "data", "objective", "optimizer"):
        assert fine[key] == plain[key], key
