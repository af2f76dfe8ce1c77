from __future__ import annotations

from pathlib import Path

import pytest
import torch
from sklearn.decomposition import PCA
from sklearn.neighbors import NearestCentroid

from motiongen.contracts import Code, GeneratorModule, MotionBatch
from motiongen.evaluation.latents import codes_of, draw_latents, latent_space, nearest_centroid, principal_plane
from tests.compositions import TAGS, batch, marionet
from tests.recognition.corpus import three_actions


def cloud(count: int, width: int, apart: float, seed: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Codes around a centre a tag, `apart` standard deviations from the origin on an axis of its own; one-hot tags."""
    labels = torch.arange(count) % TAGS
    noise = torch.randn(count, width, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    tags = torch.eye(TAGS, dtype=torch.float64)[labels]
    return noise + apart * torch.eye(width, dtype=torch.float64)[labels], tags


def test_the_nearest_centroid_is_sklearns() -> None:
    (known, known_tags), (codes, tags) = cloud(60, 8, 1.0, seed=0), cloud(45, 8, 1.0, seed=1)
    classifier = NearestCentroid().fit(known.numpy(), known_tags.argmax(dim=1).numpy())
    expected = classifier.score(codes.numpy(), tags.argmax(dim=1).numpy())
    assert 0.3 < expected < 1.0
    assert nearest_centroid(codes, tags, known, known_tags) == pytest.approx(expected)


def test_codes_that_are_apart_tell_the_tag_and_noise_does_not() -> None:
    known, codes = cloud(500, 8, 20.0, seed=0), cloud(500, 8, 20.0, seed=1)
    assert nearest_centroid(*codes, *known) == 1.0
    noise, other = cloud(500, 8, 0.0, seed=0), cloud(500, 8, 0.0, seed=1)
    assert nearest_centroid(*other, *noise) == pytest.approx(1 / TAGS, abs=0.06)


def test_a_tag_that_was_never_known_is_never_the_nearest() -> None:
    codes = torch.zeros(1, 2, dtype=torch.float64)
    tags = torch.tensor([[0.0, 1.0]], dtype=torch.float64)
    known = torch.ones(1, 2, dtype=torch.float64)
    assert nearest_centroid(codes, tags, known, tags) == 1.0
    assert nearest_centroid(codes, tags.flip(1), known, tags) == 0.0


def test_the_principal_plane_is_sklearns_but_for_the_signs() -> None:
    codes, _ = cloud(40, 6, 3.0, seed=2)
    plane, expected = principal_plane(codes), torch.from_numpy(PCA(2).fit_transform(codes.numpy()))
    torch.testing.assert_close(plane.abs(), expected.abs())
    torch.testing.assert_close(principal_plane(codes.flip(0)), plane.flip(0))
    assert principal_plane(codes[:, :1]).shape == (40, 2)


def test_codes_are_those_that_training_draws() -> None:
    generator = marionet().eval()
    one = batch((9, 9))
    noise = torch.Generator()
    found = codes_of(generator, [one], noise.manual_seed(3))
    assert found is not None
    with torch.inference_mode():
        drawn = generator.encoder.posterior(one).sample(noise.manual_seed(3))
    torch.testing.assert_close(found.latent, drawn.double())
    assert torch.equal(found.latent, found.modulated), "MARIONET has no conditioning between code and unroller"
    assert codes_of(GeneratorWithoutCodes(), [one], noise) is None


class GeneratorWithoutCodes(GeneratorModule):
    def __init__(self) -> None:
        super().__init__()
        self.weight = torch.nn.Parameter(torch.zeros(1))


class Marked(GeneratorWithoutCodes):
    """Its codes are noise before conditioning, and name the action behind it."""

    def code(self, batch: MotionBatch, generator: torch.Generator) -> Code:
        tags = batch.condition.tags
        return Code(torch.randn(len(tags), 4, generator=generator), 100 * tags)


def test_the_space_of_a_code_that_conditioning_tells_the_action(tmp_path: Path) -> None:
    data = three_actions(tmp_path)
    space = latent_space(Marked(), data, batch_size=4, seed=0)
    assert space is not None
    assert space.figures() == {"tag_from_latent": space.before, "tag_from_modulated": 1.0, "tag_by_commonest": 2 / 6}
    assert space.before < 1.0
    assert space.latent.shape == space.modulated.shape == (len(data.test_items()), 2)
    again = latent_space(Marked(), data, batch_size=4, seed=0)
    assert again is not None
    assert torch.equal(space.latent, again.latent)
    draw_latents(tmp_path / "latents.png", space)
    assert (tmp_path / "latents.png").stat().st_size > 5_000
    assert latent_space(GeneratorWithoutCodes(), data, batch_size=4, seed=0) is None
