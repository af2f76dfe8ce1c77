"""UM-CVAE's stages together: training, the bank, use."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from motiongen.contracts import MotionBatch
from motiongen.generation.checkpoint import load_generator, save_generator
from motiongen.objectives.objective import Objective
from motiongen.objectives.quantities import local_joints, pose
from tests.compositions import batch, skeleton
from tests.plugins.um_cvae import um_cvae

TAGS = ("bow", "kick", "run", "walk", "wave")


def seeded() -> torch.Generator:
    return torch.Generator().manual_seed(7)


def concluded(interpolation: float = 0.0):
    generator = um_cvae(interpolation)
    generator.conclude([batch((9, 5, 12, 8, 7), seed=1), batch((6, 6, 20, 4, 4), seed=2)])
    return generator


def test_gradients_reach_every_parameter():
    loss = Objective(
        quantities={"pose": pose, "joints": local_joints},
        weights={"pose": 1.0, "joints": 1.0, "kl": 1e-5},
        velocity=0.0,
        first_pass=0.0,
        last_pass=1.0,
    )
    generator, data = um_cvae(), batch((9, 5, 12))
    terms = loss.terms(generator.reconstruct(data, 0.0, seeded()), data, skeleton())
    loss.total(terms, 0.0).backward()
    missing = [name for name, p in generator.named_parameters() if p.grad is None or not p.grad.abs().sum() > 0]
    assert missing == []


def test_reconstruction_does_not_depend_on_padding_or_on_what_it_holds():
    generator, tight, loose = um_cvae(), batch((9, 5)), batch((9, 5), frames=20)
    dirty = MotionBatch(loose.motion + 100 * ~loose.condition.mask.unsqueeze(-1), loose.condition)
    mask = tight.condition.mask
    with torch.no_grad():
        short, long, odd = (generator.reconstruct(data, 0.0, seeded()).motion for data in (tight, loose, dirty))
    torch.testing.assert_close(short[mask], long[:, :9][mask], atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(short[mask], odd[:, :9][mask], atol=1e-5, rtol=1e-5)


def test_generation_does_not_depend_on_padding():
    generator = concluded()
    short = generator.generate(batch((9, 5)).condition, seed=1)
    long = generator.generate(batch((9, 5), frames=20).condition, seed=1)
    torch.testing.assert_close(short, long[:, :9], atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("make", [um_cvae, concluded])
@pytest.mark.parametrize("frames", [1, 20, 60, 200])
def test_generates_the_length_that_was_asked_for(make, frames):
    motion = make().generate(batch((frames,)).condition, seed=0)
    assert motion.shape == (1, frames, 135)
    assert torch.isfinite(motion).all()


@pytest.mark.parametrize("interpolation", [0.0, 1.0])
def test_the_seed_decides_the_motion(interpolation):
    generator, condition = concluded(interpolation), batch((8, 8)).condition
    assert torch.equal(generator.generate(condition, 1), generator.generate(condition, 1))
    assert not torch.equal(generator.generate(condition, 1), generator.generate(condition, 2))


def test_of_the_condition_the_action_alone_changes_the_motion():
    generator, condition = concluded(), batch((8, 8)).condition
    base = generator.generate(condition, seed=0)
    for field in ("next_tags", "initial_motion", "trajectory"):
        changed = replace(condition, **{field: getattr(condition, field).flip(0)})
        assert torch.equal(base, generator.generate(changed, seed=0)), field
    other = generator.generate(replace(condition, tags=condition.tags.flip(0)), seed=0)
    assert (base - other).abs().max() > 1e-3


def test_the_bank_is_saved_with_the_weights(tmp_path):
    trained, other = concluded(), um_cvae()
    torch.nn.init.ones_(other.decoder.pose.weight)
    save_generator(tmp_path / "generator.pt", trained, TAGS, ())
    load_generator(tmp_path / "generator.pt", other, TAGS)
    assert len(other.conditioning.bank.entries) == 10
    condition = batch((8, 8, 8)).condition
    assert torch.equal(trained.generate(condition, 4), other.generate(condition, 4))


def test_bfloat16_autocast():
    generator, data = concluded(), batch((9, 5))
    with torch.autocast("cpu", dtype=torch.bfloat16):
        prediction = generator.reconstruct(data, 0.0, seeded())
        motion = generator.generate(data.condition, seed=1)
    assert torch.isfinite(prediction.motion).all()
    exact = generator.generate(data.condition, seed=1)
    assert (motion.float() - exact).abs().max() < 0.05 * exact.abs().max()
