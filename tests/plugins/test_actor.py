"""ACTOR's composition, as its experiment file states it, and its alternatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from hydra.utils import instantiate
from torch import Tensor, nn

from motiongen.configuration import compose
from motiongen.contracts import Code, CompositionError, GeneratorModule, MotionBatch
from motiongen.objectives.terms import kl_to_standard_normal
from tests.compositions import INITIAL_FRAMES, TAGS, batch, cannot_be_reached

WIDTH, FEEDFORWARD, LAYERS, HEADS = 256, 1024, 8, 4
ACTOR = ("+experiment=actor",)
COMPOSITIONS = {
    "actor": ACTOR,
    "mean_pooling": (*ACTOR, "generator/encoder=mean_pooling"),
    "gru_encoder": (*ACTOR, "generator/encoder=gru_encoder"),
    "one_hot": (*ACTOR, "generator/conditioning=one_hot"),
    "fully_connected": (
        *ACTOR,
        "generator/encoder=fully_connected_encoder",
        "generator/decoder=fully_connected_decoder",
    ),
    "autoregressive": (
        *ACTOR,
        "generator/decoder=autoregressive_transformer",
        "generator/training=teacher_forcing",
    ),
    "marionet_without_time_unrolling": (
        "+experiment=marionette",
        "generator/unroller=repetition",
        "generator/unroller/query=[tag_injection]",
    ),
}


def built(*overrides: str, features: int = 135, tags: int = TAGS) -> GeneratorModule:
    """The generator of a command line, with weights from seed 0."""
    torch.manual_seed(0)
    return instantiate(compose(overrides).generator)(features=features, tags=tags, initial_frames=INITIAL_FRAMES)


def seeded() -> torch.Generator:
    return torch.Generator().manual_seed(7)


@pytest.fixture(scope="module", params=COMPOSITIONS, name="composition")
def each_composition(request) -> GeneratorModule:
    return built(*COMPOSITIONS[request.param], "scale=smoke").eval()


@pytest.fixture(scope="module", name="actor")
def actor_at_paper_scale() -> GeneratorModule:
    """24 joints in 6D form, as in the paper, and the 13 actions of NTU-13."""
    return built(*ACTOR, "scale=paper", features=147, tags=13).eval()


def test_sizes_are_the_papers(actor) -> None:
    attention = {
        "in_proj_weight": (3 * WIDTH, WIDTH),
        "in_proj_bias": (3 * WIDTH,),
        "out_proj.weight": (WIDTH, WIDTH),
        "out_proj.bias": (WIDTH,),
    }
    common = {
        **{f"self_attn.{name}": shape for name, shape in attention.items()},
        "linear1.weight": (FEEDFORWARD, WIDTH),
        "linear1.bias": (FEEDFORWARD,),
        "linear2.weight": (WIDTH, FEEDFORWARD),
        "linear2.bias": (WIDTH,),
        **{f"norm{place}.{part}": (WIDTH,) for place in (1, 2) for part in ("weight", "bias")},
    }
    crossing = {f"multihead_attn.{name}": shape for name, shape in attention.items()}
    norm = {f"norm3.{part}": (WIDTH,) for part in ("weight", "bias")}
    expected = {
        "encoder.pose_embedding.weight": (WIDTH, 147),
        "encoder.pose_embedding.bias": (WIDTH,),
        "encoder.mean_tokens": (13, WIDTH),
        "encoder.log_variance_tokens": (13, WIDTH),
        "conditioning.biases": (13, WIDTH),
        "decoder.pose.weight": (147, WIDTH),
        "decoder.pose.bias": (147,),
    }
    for layer in range(LAYERS):
        expected |= {f"encoder.transformer.layers.{layer}.{name}": shape for name, shape in common.items()}
        decoder = {**common, **crossing, **norm}
        expected |= {f"decoder.transformer.layers.{layer}.{name}": shape for name, shape in decoder.items()}
    assert {name: tuple(value.shape) for name, value in actor.named_parameters()} == expected
    heads = {module.num_heads for module in actor.modules() if isinstance(module, nn.MultiheadAttention)}
    assert heads == {HEADS}
    rates = {module.p for module in actor.modules() if isinstance(module, nn.Dropout)}
    assert rates == {0.1}


def test_the_number_of_parameters_is_the_papers(actor) -> None:
    attention = 4 * (WIDTH * WIDTH + WIDTH)
    encoder_layer = attention + 2 * WIDTH * FEEDFORWARD + FEEDFORWARD + WIDTH + 2 * 2 * WIDTH
    decoder_layer = encoder_layer + attention + 2 * WIDTH
    poses = 147 * WIDTH + WIDTH + WIDTH * 147 + 147
    expected = LAYERS * (encoder_layer + decoder_layer) + poses + 3 * 13 * WIDTH
    assert expected == 14_831_251
    assert sum(parameter.numel() for parameter in actor.parameters()) == expected


def table_of_positions(length: int) -> Tensor:
    """(L, 1, D), sines and cosines written into their places one after the other."""
    position, table = np.arange(length)[:, None], np.zeros((length, WIDTH))
    rate = np.exp(np.arange(0, WIDTH, 2) * -(np.log(10000.0) / WIDTH))
    table[:, 0::2], table[:, 1::2] = np.sin(position * rate), np.cos(position * rate)
    return torch.from_numpy(table).float()[:, None]


class SequenceFirst(nn.Module):
    """ACTOR's network written down once more, sequence first, with one label for each motion."""

    def __init__(self) -> None:
        super().__init__()
        self.mu_queries = nn.Parameter(torch.empty(13, WIDTH))
        self.sigma_queries = nn.Parameter(torch.empty(13, WIDTH))
        self.action_biases = nn.Parameter(torch.empty(13, WIDTH))
        self.skeleton_embedding = nn.Linear(147, WIDTH)
        self.final_layer = nn.Linear(WIDTH, 147)
        sizes = {"dim_feedforward": FEEDFORWARD, "dropout": 0.1, "activation": "gelu"}
        encoder_layer = nn.TransformerEncoderLayer(WIDTH, HEADS, **sizes)
        self.encoder = nn.TransformerEncoder(encoder_layer, LAYERS, enable_nested_tensor=False)
        self.decoder = nn.TransformerDecoder(nn.TransformerDecoderLayer(WIDTH, HEADS, **sizes), LAYERS)

    def load(self, generator: GeneratorModule) -> None:
        renamed = {
            "encoder.mean_tokens": "mu_queries",
            "encoder.log_variance_tokens": "sigma_queries",
            "conditioning.biases": "action_biases",
            "encoder.pose_embedding": "skeleton_embedding",
            "decoder.pose": "final_layer",
            "encoder.transformer": "encoder",
            "decoder.transformer": "decoder",
        }
        state = {}
        for name, value in generator.state_dict().items():
            (prefix,) = (prefix for prefix in renamed if name.startswith(prefix))
            state[renamed[prefix] + name.removeprefix(prefix)] = value
        self.load_state_dict(state)

    def encode(self, poses: Tensor, labels: Tensor, lengths: Tensor) -> tuple[Tensor, Tensor]:
        """Poses (T, B, F) to mean and log-variance (B, D)."""
        tokens = torch.stack([self.mu_queries[labels], self.sigma_queries[labels]])
        sequence = torch.cat([tokens, self.skeleton_embedding(poses)])
        padding = torch.arange(len(sequence))[None] >= lengths[:, None] + 2
        output = self.encoder(sequence + table_of_positions(len(sequence)), src_key_padding_mask=padding)
        return output[0], output[1]

    def decode(self, latent: Tensor, labels: Tensor, lengths: Tensor) -> Tensor:
        """Codes (B, D) to poses (T, B, F)."""
        queries = table_of_positions(int(lengths.max())).expand(-1, len(latent), -1)
        memory = (latent + self.action_biases[labels])[None]
        padding = torch.arange(len(queries))[None] >= lengths[:, None]
        return self.final_layer(self.decoder(queries, memory, tgt_key_padding_mask=padding))


def test_agrees_with_a_plain_sequence_first_transformer(actor) -> None:
    reference = SequenceFirst().eval()
    reference.load(actor)
    draw, lengths, labels = seeded(), torch.tensor([60, 43, 17]), torch.tensor([3, 0, 12])
    data = batch(tuple(lengths.tolist()))
    motion = torch.randn(3, 60, 147, generator=draw) * data.condition.mask.unsqueeze(-1)
    condition = replace(data.condition, tags=torch.eye(13)[labels])
    latent = torch.randn(3, WIDTH, generator=draw)
    with torch.no_grad():
        posterior = actor.encoder.posterior(MotionBatch(motion, condition))
        mean, log_variance = reference.encode(motion.transpose(0, 1), labels, lengths)
        code = Code(latent, actor.conditioning(latent, condition, draw))
        poses = actor.decoder.generate(actor.unroller(code, condition), condition)
        expected = reference.decode(latent, labels, lengths).transpose(0, 1)
    torch.testing.assert_close(posterior.mean, mean, atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(posterior.log_variance, log_variance, atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(poses[condition.mask], expected[condition.mask], atol=1e-5, rtol=1e-5)


def test_actors_prior_is_standard_normal_whatever_the_condition(actor) -> None:
    condition = replace(batch((4, 7)).condition, tags=torch.eye(13)[:2])
    assert kl_to_standard_normal(actor.encoder.prior(condition)).item() == 0
    assert actor.encoder.prior(condition).mean.shape == (2, WIDTH)


@pytest.mark.parametrize("name", COMPOSITIONS)
def test_gradients_reach_every_parameter(name) -> None:
    generator, data = built(*COMPOSITIONS[name], "scale=smoke").eval(), batch((9, 5, 12))
    prediction = generator.reconstruct(data, 0.0, seeded())
    error = (prediction.motion - data.motion)[data.condition.mask].square().mean()
    (error + kl_to_standard_normal(prediction.posterior)).backward()
    missing = {name for name, p in generator.named_parameters() if p.grad is None or not p.grad.abs().sum() > 0}
    assert missing <= cannot_be_reached(generator)


def test_padding_changes_no_valid_frame(composition) -> None:
    tight, loose = batch((9, 5)), batch((9, 5), frames=20)
    hole = 100 * (~loose.condition.mask).unsqueeze(-1)
    dirty = MotionBatch(loose.motion + hole, replace(loose.condition, trajectory=loose.condition.trajectory + hole))
    mask = tight.condition.mask
    with torch.no_grad():
        short = composition.reconstruct(tight, 0.0, seeded())
        for padded in (loose, dirty):
            long = composition.reconstruct(padded, 0.0, seeded())
            torch.testing.assert_close(long.posterior.mean, short.posterior.mean, atol=1e-5, rtol=1e-5)
            torch.testing.assert_close(long.motion[:, :9][mask], short.motion[mask], atol=1e-5, rtol=1e-5)
    generated = composition.generate(loose.condition, seed=1)
    torch.testing.assert_close(generated[:, :9], composition.generate(tight.condition, seed=1), atol=1e-5, rtol=1e-5)
    assert (generated[:, 9:] == 0).all()


@pytest.mark.parametrize("frames", [1, 20, 60, 200])
def test_generates_any_length_by_the_seed_alone(composition, frames) -> None:
    condition = batch((frames, frames)).condition
    motion = composition.generate(condition, seed=1)
    assert motion.shape == (2, frames, 135)
    assert torch.isfinite(motion).all()
    assert torch.equal(motion, composition.generate(condition, seed=1))
    assert not torch.equal(motion, composition.generate(condition, seed=2))


def test_the_action_changes_the_motion_and_frames_differ(composition) -> None:
    condition = batch((8, 8)).condition
    motion = composition.generate(condition, seed=0)
    other = composition.generate(replace(condition, tags=condition.tags.flip(0)), seed=0)
    assert (motion - other).abs().max() > 1e-4
    assert motion.diff(dim=1).abs().amax(dim=-1).min() > 1e-5


@pytest.mark.parametrize("decoder", ["one_shot_transformer", "fully_connected_decoder"])
def test_a_motion_that_would_stand_still_is_refused(decoder) -> None:
    with pytest.raises(Exception, match="so the motion would stand still") as caught:
        built(*ACTOR, "generator/unroller=repetition", f"generator/decoder={decoder}", "scale=smoke")
    assert isinstance(caught.value.__cause__ or caught.value, CompositionError)


def test_a_query_of_the_tag_alone_does_not_keep_time() -> None:
    unrolling = (*ACTOR, "generator/unroller=time_unrolling", "scale=smoke")
    with pytest.raises(Exception, match="TimeUnrolling gives every frame the same query"):
        built(*unrolling, "generator/unroller/query=[tag_injection]")
    built(*unrolling, "generator/unroller/query=[reverse_positional_encoding,tag_injection]")
