from __future__ import annotations

from dataclasses import fields, replace

import pytest
import torch

from motiongen.contracts import Code, CompositionError, MotionBatch
from motiongen.generation.staged import refuse_what_cannot_work
from motiongen.objectives.objective import Objective
from motiongen.objectives.quantities import local_joints, rotation, translation
from motiongen_plugins.direct.direct import Direct
from tests.compositions import batch, marionet, skeleton


def objective() -> Objective:
    return Objective(
        quantities={"rotation": rotation, "translation": translation, "joints": local_joints},
        weights={"rotation": 1.0, "translation": 0.5, "joints": 2.0, "kl": 1e-3},
        velocity=2.0,
        first_pass=0.1,
        last_pass=0.9,
    )


def seeded() -> torch.Generator:
    return torch.Generator().manual_seed(7)


@pytest.mark.parametrize("progress", [0.0, 0.5, 1.0])
def test_gradients_reach_every_parameter(progress):
    generator, loss, data = marionet(), objective(), batch((9, 5, 12))
    terms = loss.terms(generator.reconstruct(data, progress, seeded()), data, skeleton())
    loss.total(terms, progress).backward()
    missing = [name for name, p in generator.named_parameters() if p.grad is None or not p.grad.abs().sum() > 0]
    assert missing == []


@pytest.mark.parametrize("progress", [0.0, 1.0])
def test_reconstruction_of_valid_frames_does_not_depend_on_padding(progress):
    generator = marionet().eval()
    tight, loose = batch((9, 5)), batch((9, 5), frames=20)
    with torch.no_grad():
        short = generator.reconstruct(tight, progress, seeded()).motion
        long = generator.reconstruct(loose, progress, seeded()).motion[:, :9]
    mask = tight.condition.mask
    torch.testing.assert_close(short[mask], long[mask], atol=1e-5, rtol=1e-5)


def test_generation_of_valid_frames_does_not_depend_on_padding():
    generator = marionet()
    short = generator.generate(batch((9, 5)).condition, seed=1)
    long = generator.generate(batch((9, 5), frames=20).condition, seed=1)
    torch.testing.assert_close(short, long[:, :9], atol=1e-5, rtol=1e-5)
    assert (long[:, 9:] == 0).all()


def test_garbage_in_padded_frames_changes_nothing():
    generator, data = marionet().eval(), batch((9, 5), frames=12)
    hole = ~data.condition.mask.unsqueeze(-1)
    dirty = MotionBatch(
        data.motion + 100 * hole, replace(data.condition, trajectory=data.condition.trajectory + 100 * hole)
    )
    with torch.no_grad():
        clean_motion = generator.reconstruct(data, 0.0, seeded()).motion
        dirty_motion = generator.reconstruct(dirty, 0.0, seeded()).motion
    mask = data.condition.mask
    torch.testing.assert_close(clean_motion[mask], dirty_motion[mask], atol=1e-5, rtol=1e-5)


def test_generation_fed_its_own_past_equals_teacher_forced_output():
    generator = marionet().eval()
    data = batch((11, 7, 4))
    motion = generator.generate(data.condition, seed=3)
    own = MotionBatch(motion, data.condition)
    with torch.no_grad():
        again = generator.reconstruct(own, 0.0, torch.Generator().manual_seed(3)).motion
    mask = data.condition.mask
    torch.testing.assert_close(again[mask], motion[mask], atol=1e-5, rtol=1e-5)


def test_the_seed_decides_the_motion():
    generator, condition = marionet(), batch((8, 8)).condition
    assert torch.equal(generator.generate(condition, 1), generator.generate(condition, 1))
    assert not torch.equal(generator.generate(condition, 1), generator.generate(condition, 2))


def test_generation_ignores_dropout_and_leaves_the_mode_as_it_was():
    generator, condition = marionet(dropout=0.5).train(), batch((8, 8)).condition
    assert torch.equal(generator.generate(condition, 1), generator.generate(condition, 1))
    assert generator.training


@pytest.mark.parametrize("frames", [1, 2, 40])
def test_generates_the_length_that_was_asked_for(frames):
    motion = marionet().generate(batch((frames,)).condition, seed=0)
    assert motion.shape == (1, frames, 135)
    assert torch.isfinite(motion).all()


def test_order_of_the_batch_does_not_matter():
    generator, data = marionet().eval(), batch((9, 9, 9))
    order = torch.tensor([2, 0, 1])
    condition = data.condition
    shuffled = type(condition)(**{field.name: getattr(condition, field.name)[order] for field in fields(condition)})
    with torch.no_grad():
        straight = generator.encoder.prior(condition)
        turned = generator.encoder.prior(shuffled)
        torch.testing.assert_close(straight.mean[order], turned.mean)
        code = straight.mean
        motion = generator.decoder.generate(generator.unroller(Code(code, code), condition), condition)
        mixed = generator.decoder.generate(generator.unroller(Code(code[order], code[order]), shuffled), shuffled)
    torch.testing.assert_close(motion[order], mixed, atol=1e-5, rtol=1e-5)


def test_embeddings_are_shared_by_the_stages_that_use_them():
    generator = marionet()
    assert generator.encoder.pose_embedding is generator.decoder.pose_embedding
    assert generator.encoder.tag_embedding is generator.unroller.query["tag_injection"].tag_embedding


class OneShot(torch.nn.Module):
    autoregressive = False
    reads = frozenset()
    uses = frozenset({"queries"})


class Tokens(torch.nn.Module):
    reads = frozenset()
    carries = frozenset({"memory"})


class ReadsNothing(torch.nn.Module):
    reads = frozenset()


def test_a_scheme_without_effect_is_refused():
    good = marionet()
    stages = good.encoder, good.conditioning, good.unroller
    with pytest.raises(CompositionError, match=r"ScheduledSampling.*OneShot does not read the past"):
        refuse_what_cannot_work(*stages, OneShot(), good.scheme)
    with pytest.raises(CompositionError, match=r"AutoregressiveTransformer reads the past, which Direct does not"):
        refuse_what_cannot_work(*stages, good.decoder, Direct())


def test_a_code_that_never_reaches_the_decoder_is_refused():
    good = marionet()
    with pytest.raises(CompositionError, match=r"Tokens puts the code into controls\.memory, and OneShot reads"):
        refuse_what_cannot_work(good.encoder, good.conditioning, Tokens(), OneShot(), Direct())


def test_a_generator_that_does_not_know_the_action_is_refused():
    good = marionet()
    with pytest.raises(CompositionError, match=r"no stage reads the action when it generates \(ReadsNothing"):
        refuse_what_cannot_work(ReadsNothing(), good.conditioning, Tokens(), good.decoder, good.scheme)
