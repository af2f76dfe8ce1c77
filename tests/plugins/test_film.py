from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from motiongen.contracts import CompositionError, MotionBatch
from motiongen.generation.embeddings import Embeddings
from motiongen.motion.skeleton import JOINT
from motiongen_plugins.film.action_aware_encoder import LABEL, LINKS, NODES, POSITION
from motiongen_plugins.film.bank import FilmBank
from motiongen_plugins.film.film import FiLM
from motiongen_plugins.film.graph_convolution import GatingAdjacency, normalized_graph
from tests.compositions import TAGS, batch
from tests.plugins.um_cvae import DIMENSIONS, FILM

WIDTH = DIMENSIONS.width


def film(interpolation: float = 0.0) -> FiLM:
    torch.manual_seed(0)
    return FiLM(DIMENSIONS, Embeddings(DIMENSIONS), interpolation=interpolation, **FILM)


def seeded(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def test_modulation_is_gamma_times_z_plus_beta():
    conditioning, data = film(), batch((9, 6, 4))
    latent = torch.randn(3, WIDTH, generator=seeded())
    got = conditioning.reconstruct(latent, data, seeded())
    features = conditioning.encoder(data.motion, data.condition.tags, data.condition.mask)
    weight, bias = conditioning.modulation.weight, conditioning.modulation.bias
    for row in range(3):
        for d in range(WIDTH):
            gamma = weight[d] @ features[row] + bias[d]
            beta = weight[WIDTH + d] @ features[row] + bias[WIDTH + d]
            torch.testing.assert_close(got[row, d], gamma * latent[row, d] + beta)


def test_graph_convolution_equals_explicit_loops():
    torch.manual_seed(1)
    nodes, inputs, outputs, candidates = 4, 3, 5, 3
    layer = GatingAdjacency(normalized_graph(nodes, [(0, 1), (1, 2), (2, 3)]), inputs, outputs, candidates=candidates)
    lengths = (6, 2)
    x = torch.randn(2, 6, nodes, inputs)
    mask = torch.arange(6) < torch.tensor(lengths).unsqueeze(1)
    got = layer(x, mask)
    for row, length in enumerate(lengths):
        mean = sum(x[row, t].flatten() for t in range(length)) / length
        scores = [torch.exp(layer.gate.weight[k] @ mean + layer.gate.bias[k]) for k in range(candidates)]
        blend = [score / sum(scores) for score in scores]
        for t in range(length):
            for n in range(nodes):
                expected = torch.zeros(outputs)
                for m in range(nodes):
                    link = sum(blend[k] * layer.candidates[k, n, m] for k in range(candidates))
                    expected += link * (layer.projection.weight @ x[row, t, m] + layer.projection.bias)
                torch.testing.assert_close(got[row, t, n], expected, atol=1e-6, rtol=1e-5)


def test_the_gate_answers_to_the_motion():
    torch.manual_seed(1)
    layer = GatingAdjacency(normalized_graph(2, []), 1, 1, candidates=2)
    with torch.no_grad():
        layer.candidates.copy_(torch.stack([torch.eye(2), torch.eye(2).flip(0)]))  # keep the nodes, swap the nodes
        layer.projection.weight.fill_(1.0)
        layer.projection.bias.zero_()
        layer.gate.weight.copy_(torch.tensor([[50.0, 0.0], [-50.0, 0.0]]))
        layer.gate.bias.zero_()
    mask = torch.ones(1, 1, dtype=torch.bool)
    kept, swapped = (layer(torch.tensor([[[[first], [2.0]]]]), mask).flatten().tolist() for first in (1.0, -1.0))
    assert kept == pytest.approx([1.0, 2.0])
    assert swapped == pytest.approx([2.0, -1.0])


def test_normalized_graph_is_that_of_kipf_and_welling():
    a = torch.tensor([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]])
    d = torch.diag(torch.tensor([2.0, 3.0, 2.0])).inverse().sqrt()
    torch.testing.assert_close(normalized_graph(3, [(0, 1), (1, 2)]), d @ a @ d)


def test_the_graph_is_the_skeleton_with_position_and_label():
    graph = normalized_graph(NODES, LINKS) > 0
    neighbours = {n for n in range(NODES) if graph[JOINT["left_knee"], n]}
    assert neighbours == {JOINT[name] for name in ("left_hip", "left_knee", "left_ankle")} | {LABEL}
    assert {n for n in range(NODES) if graph[POSITION, n]} == {JOINT["pelvis"], POSITION, LABEL}
    assert graph[LABEL].all()


@pytest.mark.parametrize("joint", [3, 4, 6, 9])
def test_fusion_puts_joints_position_and_label_side_by_side(joint):
    dimensions = replace(DIMENSIONS, features=22 * joint + 3)
    encoder = FiLM(dimensions, Embeddings(dimensions), interpolation=0.0, **FILM).encoder
    motion, tags = torch.randn(2, 5, dimensions.features), torch.eye(TAGS)[:2]
    nodes = encoder.fuse(motion, tags)
    assert nodes.shape == (2, 5, 24, joint)
    assert torch.equal(nodes[:, :, 7], motion[..., 7 * joint : 8 * joint])
    torch.testing.assert_close(nodes[:, :, POSITION], encoder.position(motion[..., -3:]))
    torch.testing.assert_close(nodes[0, 3, LABEL], encoder.label.weight[:, 0] + encoder.label.bias)


def test_a_pose_that_is_not_made_of_joints_is_refused():
    dimensions = replace(DIMENSIONS, features=134)
    with pytest.raises(CompositionError, match="22 joints and a position, not of 134 numbers"):
        FiLM(dimensions, Embeddings(dimensions), interpolation=0.0, **FILM)


def test_the_label_reaches_the_parameters():
    conditioning, data = film(), batch((9, 9))
    other = MotionBatch(data.motion, replace(data.condition, tags=data.condition.tags.flip(0)))
    assert (conditioning.of_motion(data) - conditioning.of_motion(other)).abs().max() > 1e-4


def test_conclusion_files_every_motion_with_its_tags():
    conditioning, batches = film(), [batch((9, 6, 4), seed=1), batch((5, 12), seed=2)]
    conditioning.conclude(iter(batches))
    bank = conditioning.bank
    assert torch.equal(bank.tags, torch.cat([b.condition.tags for b in batches]))
    torch.testing.assert_close(bank.entries, torch.cat([conditioning.of_motion(b) for b in batches]))
    assert not bank.entries.requires_grad
    conditioning.conclude(batches[:1])
    assert len(bank.entries) == len(bank.tags) == 3


def numbered_bank(tags: torch.Tensor) -> FilmBank:
    """Entry number i holds the number i."""
    bank = FilmBank(tags.shape[1], 2)
    bank.fill(tags, torch.arange(len(tags)).float().unsqueeze(1).expand(-1, 2).clone())
    return bank


def test_only_entries_of_the_action_are_drawn_each_about_as_often():
    owner = torch.arange(40) % 4
    bank = numbered_bank(torch.eye(5)[owner])
    wanted = torch.arange(4000) % 4
    drawn = bank.draw(torch.eye(5)[wanted], torch.full((4000, 2), -1.0), 0.0, seeded())[:, 0].long()
    assert torch.equal(owner[drawn], wanted)
    counts = drawn.bincount(minlength=40)
    # 100 each on average, with a standard deviation of 9.5
    assert counts.min() > 60
    assert counts.max() < 140


def test_draws_follow_the_seed():
    bank = numbered_bank(torch.eye(5)[torch.arange(40) % 4])
    tags, otherwise = torch.eye(5)[torch.arange(4)], torch.zeros(4, 2)
    one, again, other = (bank.draw(tags, otherwise, 0.5, seeded(seed)) for seed in (1, 1, 2))
    assert torch.equal(one, again)
    assert not torch.equal(one, other)


def test_of_several_tags_the_entries_that_share_most_are_drawn():
    bank = numbered_bank(torch.tensor([[1.0, 0, 0], [1, 1, 0], [1, 1, 1], [0, 0, 1]]))
    tags = torch.tensor([[1.0, 1, 0], [0, 1, 0], [1, 0, 0]]).repeat_interleave(50, dim=0)
    drawn = bank.draw(tags, torch.full((150, 2), -1.0), 0.0, seeded())[:, 0].view(3, 50)
    assert drawn[0].unique().tolist() == [1]
    assert drawn[1].unique().tolist() == [1]
    assert drawn[2].unique().tolist() == [0]


def test_interpolation_stays_between_two_entries_of_the_action():
    bank = FilmBank(2, 3)
    corners = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]])
    bank.fill(torch.tensor([[1.0, 0], [1, 0], [1, 0], [0, 1]]), corners)
    tags = torch.tensor([[1.0, 0]]).expand(500, -1)
    drawn = bank.draw(tags, torch.full((500, 3), -1.0), 1.0, seeded())
    x, y, z = drawn.unbind(1)
    assert (z == 0).all()
    assert (drawn >= 0).all()
    # on the line between two corners: one of the triangle's three sides
    assert ((x * y).abs() < 1e-9).logical_or(((x + y) - 1).abs() < 1e-6).all()
    assert ((x > 0.01) & (x < 0.99)).any()
    near = bank.draw(tags, torch.full((500, 3), -1.0), 0.1, seeded())
    assert torch.cdist(near, corners[:3]).min(dim=1).values.max() <= 0.1 * math.sqrt(2) + 1e-6


def test_an_action_that_the_bank_does_not_know_gets_what_its_label_gives():
    conditioning, data = film(), batch((6, 6))  # tags 0 and 1
    latent = torch.randn(2, WIDTH, generator=seeded())
    condition = replace(data.condition, tags=torch.eye(TAGS)[[0, 3]])
    untrained = conditioning(latent, condition, seeded())
    gamma, beta = conditioning.of_label(condition.tags).chunk(2, dim=1)
    torch.testing.assert_close(untrained, gamma * latent + beta)
    assert (gamma[0] - gamma[1]).abs().max() > 1e-5
    conditioning.conclude([data])
    trained = conditioning(latent, condition, seeded())
    torch.testing.assert_close(trained[1], untrained[1])
    gamma, beta = conditioning.of_motion(data)[0].chunk(2)
    torch.testing.assert_close(trained[0], gamma * latent[0] + beta)


def test_loading_brings_as_many_entries_as_were_saved():
    saved = numbered_bank(torch.eye(5))
    fresh, used = FilmBank(5, 2), numbered_bank(torch.eye(5)[:2])
    for bank in (fresh, used):
        bank.load_state_dict(saved.state_dict())
        assert torch.equal(bank.tags, saved.tags)
        assert torch.equal(bank.entries, saved.entries)
    used.load_state_dict(FilmBank(5, 2).state_dict())
    assert used.entries.shape == (0, 2)


def test_a_bank_of_another_vocabulary_is_not_loaded():
    with pytest.raises(RuntimeError, match=r"size mismatch for tags"):
        FilmBank(4, 2).load_state_dict(numbered_bank(torch.eye(5)).state_dict())
