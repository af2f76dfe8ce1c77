from __future__ import annotations

import numpy as np
import pytest
import torch

from motiongen.contracts import CompositionError
from motiongen.discovery import options
from motiongen.generation.bank import TaggedBank
from motiongen_plugins.shadow_start.shadow_start import ShadowStart
from tests.compositions import TAGS, batch, marionet
from tests.plugins.um_cvae import um_cvae

WIDTH = 6


def bank(count: int = 40, seed: int = 0) -> TaggedBank:
    draw = torch.Generator().manual_seed(seed)
    made = TaggedBank(TAGS, WIDTH)
    made.fill(torch.eye(TAGS)[torch.arange(count) % TAGS], torch.randn(count, WIDTH, generator=draw).relu())
    return made


def reference(embedding: np.ndarray, entries: np.ndarray, neighbours: int) -> np.ndarray:
    """Eq. 6 by NumPy's least squares."""
    nearest = entries[np.argsort(((entries - embedding) ** 2).sum(axis=1))[:neighbours]]
    shares, *_ = np.linalg.lstsq(nearest.T, embedding, rcond=None)
    return nearest.T @ shares


@pytest.mark.parametrize("neighbours", [1, 3, 8])
def test_the_projection_is_the_least_squares_of_the_nearest_beginnings_of_the_action(neighbours):
    known, tags = bank(), torch.eye(TAGS)[[1, 4]]
    embedding = torch.randn(2, WIDTH, generator=torch.Generator().manual_seed(1)).relu()
    got = ShadowStart(neighbours=neighbours, normalize=False).project(embedding, tags, known)
    for row, tag in enumerate((1, 4)):
        expected = reference(embedding[row].numpy(), known.entries[tag::TAGS].numpy(), neighbours)
        np.testing.assert_allclose(got[row].numpy(), expected, atol=1e-5)


def test_normalizing_gives_the_mean_norm_of_training_and_keeps_the_direction():
    known, tags = bank(), torch.eye(TAGS)[:3]
    embedding = torch.randn(3, WIDTH, generator=torch.Generator().manual_seed(1)).relu()
    plain = ShadowStart(neighbours=2, normalize=False).project(embedding, tags, known)
    scaled = ShadowStart(neighbours=2).project(embedding, tags, known)
    torch.testing.assert_close(scaled.norm(dim=1), known.entries.norm(dim=1).mean().expand(3))
    torch.testing.assert_close(torch.cosine_similarity(plain, scaled), torch.ones(3))


def test_a_beginning_of_training_stays_and_one_of_another_action_does_not():
    known = bank()
    shadow = ShadowStart(neighbours=1, normalize=False)
    own = known.entries[5:6]
    torch.testing.assert_close(shadow.project(own, torch.eye(TAGS)[:1], known), own)
    assert not torch.allclose(shadow.project(own, torch.eye(TAGS)[1:2], known), own)


def test_without_a_beginning_to_go_by_the_embedding_stays():
    embedding, tags = torch.rand(1, WIDTH), torch.eye(TAGS)[:1]
    assert torch.equal(ShadowStart().project(embedding, tags, TaggedBank(TAGS, WIDTH)), embedding)
    others = TaggedBank(TAGS, WIDTH)
    others.fill(torch.eye(TAGS)[1:3], torch.rand(2, WIDTH))
    assert torch.equal(ShadowStart().project(embedding, tags, others), embedding)


def test_repeated_beginnings_do_no_harm():
    known = TaggedBank(TAGS, WIDTH)
    entry = torch.rand(1, WIDTH)
    known.fill(torch.eye(TAGS)[:1].repeat(9, 1), entry.repeat(9, 1) + 1e-7 * torch.rand(9, WIDTH))
    got = ShadowStart(neighbours=8, normalize=False).project(torch.rand(1, WIDTH), torch.eye(TAGS)[:1], known)
    assert got.isfinite().all()
    assert float(got.norm()) < 2 * WIDTH**0.5


def test_training_keeps_the_beginnings_and_only_the_first_input_changes():
    generator, data = marionet().eval(), batch((9, 9, 9))
    generator.conclude([data, data])
    assert len(generator.decoder.beginnings) == 6
    expected = generator.decoder.pose_embedding(data.condition.initial_motion[:, -1])
    torch.testing.assert_close(generator.decoder.beginnings.entries[:3], expected)
    plain = generator.generate(data.condition, 3)
    same = generator.generate_from(lambda embedding, tags, bank: embedding, data.condition, 3)
    assert torch.equal(plain, same)
    # The embeddings of these clips are in the bank, so that one neighbour gives them back.
    nearest = ShadowStart(neighbours=1, normalize=False)(generator, data.condition, 3, None)
    torch.testing.assert_close(nearest.motion, plain, atol=1e-4, rtol=1e-4)
    assert nearest.jumps.all()
    changed = ShadowStart()(generator, data.condition, 3, None).motion
    assert not torch.allclose(changed, plain, atol=1e-3)


def test_a_generator_without_a_begin_of_pose_is_refused():
    with pytest.raises(CompositionError, match="GRUDecoder does not begin with an embedded pose"):
        ShadowStart()(um_cvae(), batch((4,)).condition, 0, None)


def test_it_is_an_option():
    assert "shadow_start" in [option.name for option in options() if option.group == "correction"]
