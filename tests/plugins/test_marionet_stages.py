"""What each of MARIONET's mechanisms promises."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import pytest
import torch

from motiongen.contracts import Code, CompositionError, Dimensions
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.positions import sinusoidal
from motiongen_plugins.repetition.repetition import Repetition
from motiongen_plugins.tag_injection.tag_injection import TagInjection
from motiongen_plugins.time_unrolling.time_unrolling import TimeUnrolling
from motiongen_plugins.trajectory_branch.trajectory_branch import TrajectoryBranch
from tests.compositions import batch, marionet


def test_reverse_positions_count_down_to_one():
    mechanism = marionet().unroller.query["reverse_positional_encoding"]
    codes = mechanism(batch((5, 3)).condition)
    torch.testing.assert_close(codes[0], sinusoidal(torch.tensor([5, 4, 3, 2, 1]), 32))
    torch.testing.assert_close(codes[1, :3], sinusoidal(torch.tensor([3, 2, 1]), 32))


def test_tag_injection_adds_the_same_code_to_every_frame():
    generator, condition = marionet(), batch((5, 3)).condition
    code = generator.unroller.query["tag_injection"](condition)
    torch.testing.assert_close(code[:, 0], generator.encoder.tag_embedding(condition.tags))
    assert code.shape == (2, 1, 32)


def test_encoder_tells_current_and_next_tag_apart():
    generator, condition = marionet().eval(), batch((5, 5)).condition
    swapped = replace(condition, tags=condition.next_tags, next_tags=condition.tags)
    with torch.no_grad():
        difference = generator.encoder.prior(condition).mean - generator.encoder.prior(swapped).mean
    assert difference.abs().max() > 1e-3


def test_encoder_tells_the_order_of_the_initial_poses():
    generator, condition = marionet().eval(), batch((5, 5)).condition
    backwards = replace(condition, initial_motion=condition.initial_motion.flip(1))
    with torch.no_grad():
        difference = generator.encoder.prior(condition).mean - generator.encoder.prior(backwards).mean
    assert difference.abs().max() > 1e-3


def test_decoder_is_causal():
    generator, data = marionet().eval(), batch((8,))
    with torch.no_grad():
        latent = torch.randn(1, 32)
        controls = generator.unroller(Code(latent, latent), data.condition)
        past = data.past
        changed = past.clone()
        changed[:, 5:] += 1
        before, after = (generator.decoder(controls, data.condition, p) for p in (past, changed))
    torch.testing.assert_close(before[:, :5], after[:, :5])
    assert (before[:, 5:] - after[:, 5:]).abs().max() > 1e-3


def test_a_residual_decoder_gives_displacements():
    """Without what the output layer gives, it stands still; fed its own motion, it repeats what it generated."""
    data = batch((8, 5))
    generator = marionet(residual=1.0).eval()
    with torch.no_grad():
        free = generator.generate(data.condition, seed=0)
        latent = generator.encoder.prior(data.condition).sample(torch.Generator().manual_seed(0))
        controls = generator.unroller(Code(latent, latent), data.condition)
        past = torch.cat([data.condition.initial_motion[:, -1:], free[:, :-1]], dim=1)
        again = generator.decoder(controls, data.condition, past)
        mask = data.condition.mask
        torch.testing.assert_close(again[mask], free[mask], atol=1e-5, rtol=1e-5)
        generator.decoder.pose.weight.zero_()
        generator.decoder.pose.bias.zero_()
        still = generator.generate(data.condition, seed=0)
    assert torch.equal(still[0], data.condition.initial_motion[0, -1:].expand(8, -1))


def test_every_condition_field_changes_the_motion():
    generator, condition = marionet().eval(), batch((8, 8)).condition
    base = generator.generate(condition, seed=0)
    for field in ("tags", "next_tags", "initial_motion", "trajectory"):
        value = getattr(condition, field)
        changed = generator.generate(replace(condition, **{field: value.flip(0)}), seed=0)
        assert (base - changed).abs().max() > 1e-4, field


def test_without_time_unrolling_frames_differ_by_their_tag_and_path_alone():
    """W (z + E_a(tag)) beside the path's features, which alone change from frame to frame."""
    data = batch((6, 6))
    sizes = Dimensions(135, data.condition.tags.shape[1], 6, 32)
    embeddings = Embeddings(sizes)
    branch = partial(TrajectoryBranch, width=8, layers=1, heads=1, feedforward=8, dropout=0.0)
    unroller = Repetition(sizes, embeddings, query={"tag": TagInjection}, branches={"path": branch}).eval()
    latent = torch.randn(2, 32, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        controls = unroller(Code(latent, latent), data.condition).queries
        codes = unroller.projection(latent + embeddings.tags(data.condition.tags))
        path = unroller.branches["path"](data.condition)
    torch.testing.assert_close(controls, torch.cat([codes.unsqueeze(1).expand(-1, 6, -1), path], dim=-1))
    assert path.diff(dim=1).abs().amax() > 1e-4


def test_time_unrolling_needs_a_query():
    sizes = Dimensions(135, 5, 6, 32)
    with pytest.raises(CompositionError, match="generator/unroller/query"):
        TimeUnrolling(sizes, Embeddings(sizes), query={}, branches={}, layers=1, heads=4, feedforward=8, dropout=0.0)
