"""What each of ACTOR's mechanisms, and those it is compared with, promises by itself."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import pytest
import torch

from motiongen.contracts import Code, Dimensions, MotionBatch
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.positions import sinusoidal
from motiongen_plugins.bias_token.bias_token import BiasToken
from motiongen_plugins.fully_connected_decoder.fully_connected_decoder import FullyConnectedDecoder
from motiongen_plugins.fully_connected_encoder.fully_connected_encoder import FullyConnectedEncoder
from motiongen_plugins.gru_encoder.gru_encoder import GruEncoder
from motiongen_plugins.mean_pooling.mean_pooling import MeanPooling
from motiongen_plugins.one_hot.one_hot import OneHot
from motiongen_plugins.one_shot_transformer.one_shot_transformer import OneShotTransformer
from motiongen_plugins.repetition.repetition import Repetition
from motiongen_plugins.sinusoidal_queries.sinusoidal_queries import SinusoidalQueries
from motiongen_plugins.token_pooling.token_pooling import TokenPooling
from tests.compositions import INITIAL_FRAMES, TAGS, WIDTH, batch

SIZES = Dimensions(135, TAGS, INITIAL_FRAMES, WIDTH)
TRANSFORMER = {"layers": 2, "heads": 4, "feedforward": 48, "dropout": 0.0}
ENCODERS = {
    "token_pooling": partial(TokenPooling, **TRANSFORMER),
    "mean_pooling": partial(MeanPooling, **TRANSFORMER),
    "gru_encoder": partial(GruEncoder, layers=2),
    "fully_connected_encoder": partial(FullyConnectedEncoder, layers=2, hidden=40, dropout=0.0),
}


def made(build):
    torch.manual_seed(0)
    return build(SIZES, Embeddings(SIZES)).eval()


def code(count: int) -> Code:
    generator = torch.Generator().manual_seed(5)
    return Code(*torch.randn(2, count, WIDTH, generator=generator))


@pytest.mark.parametrize("name", ENCODERS)
def test_encoders_read_the_order_of_the_frames(name) -> None:
    encoder, data = made(ENCODERS[name]), batch((6, 6))
    with torch.no_grad():
        forwards = encoder.posterior(data)
        backwards = encoder.posterior(MotionBatch(data.motion.flip(1), data.condition))
    assert (forwards.mean - backwards.mean).abs().max() > 1e-4


@pytest.mark.parametrize(
    ("name", "sees"),
    [("token_pooling", True), ("gru_encoder", True), ("fully_connected_encoder", True), ("mean_pooling", False)],
)
def test_which_encoders_see_the_action(name, sees) -> None:
    encoder, data = made(ENCODERS[name]), batch((6, 6))
    other = MotionBatch(data.motion, replace(data.condition, tags=data.condition.tags.flip(0)))
    with torch.no_grad():
        difference = (encoder.posterior(data).mean - encoder.posterior(other).mean).abs().max()
    assert (difference > 1e-4) == sees


def test_several_tags_share_the_sum_of_their_tokens_and_biases() -> None:
    encoder, conditioning, data = made(ENCODERS["token_pooling"]), made(BiasToken), batch((6,))
    both = replace(data.condition, tags=torch.tensor([[1.0, 0.0, 0.0, 1.0, 0.0]]))
    latent = code(1).latent
    expected = latent + conditioning.biases[0] + conditioning.biases[3]
    torch.testing.assert_close(conditioning(latent, both, torch.Generator()), expected)
    with torch.no_grad():
        mixed = encoder.posterior(MotionBatch(data.motion, both))
        for table in (encoder.mean_tokens, encoder.log_variance_tokens):
            table[0] += table[3]
        summed = encoder.posterior(data)
    torch.testing.assert_close(mixed.mean, summed.mean)
    torch.testing.assert_close(mixed.log_variance, summed.log_variance)


def test_mean_pooling_is_the_mean_of_each_motion_by_itself() -> None:
    encoder, data = made(ENCODERS["mean_pooling"]), batch((7, 3))
    with torch.no_grad():
        posterior = encoder.posterior(data)
        for row, length in enumerate((7, 3)):
            poses = encoder.pose_embedding(data.motion[row : row + 1, :length])
            encoded = encoder.transformer(poses + sinusoidal(torch.arange(length), WIDTH))
            torch.testing.assert_close(posterior.mean[row], encoder.mean(encoded[0].mean(dim=0)))
            torch.testing.assert_close(posterior.log_variance[row], encoder.log_variance(encoded[0].mean(dim=0)))


def test_gru_encoder_pools_the_state_after_the_last_valid_frame() -> None:
    encoder, data = made(ENCODERS["gru_encoder"]), batch((7, 3))
    with torch.no_grad():
        posterior = encoder.posterior(data)
        for row, length in enumerate((7, 3)):
            tags = data.condition.tags[row].expand(length, -1)
            _, state = encoder.gru(encoder.embedding(torch.cat([data.motion[row, :length], tags], dim=-1)))
            torch.testing.assert_close(posterior.mean[row], encoder.mean(state[-1]))


def test_one_hot_is_a_projected_code_and_a_vector_of_the_action() -> None:
    conditioning, condition, latent = made(OneHot), batch((4, 4)).condition, code(2).latent
    of_code, of_tags = conditioning.projection.weight.split([WIDTH, TAGS], dim=1)
    expected = latent @ of_code.T + condition.tags @ of_tags.T + conditioning.projection.bias
    torch.testing.assert_close(conditioning(latent, condition, torch.Generator()), expected)


def test_sinusoidal_queries_ask_for_frames_and_remember_the_code() -> None:
    drawn, condition = code(2), batch((5, 3)).condition
    controls = made(SinusoidalQueries)(drawn, condition)
    torch.testing.assert_close(controls.queries, sinusoidal(torch.arange(5), WIDTH).expand(2, -1, -1))
    assert torch.equal(controls.memory, drawn.modulated.unsqueeze(1))
    assert torch.equal(controls.latent, drawn.latent)
    assert controls.mask.tolist() == [[True], [True]]


def test_repetition_gives_every_frame_the_code() -> None:
    drawn, condition = code(2), batch((5, 3)).condition
    controls = made(partial(Repetition, query={}, branches={}))(drawn, condition)
    assert controls.queries.shape == (2, 5, WIDTH)
    assert (controls.queries == drawn.modulated.unsqueeze(1)).all()
    assert (controls.memory == controls.queries).all()
    assert torch.equal(controls.mask, condition.mask)


def test_frames_of_the_fully_connected_decoder_do_not_see_each_other() -> None:
    decoder = made(partial(FullyConnectedDecoder, layers=2, hidden=40, dropout=0.0))
    condition = batch((5,)).condition
    controls = made(SinusoidalQueries)(code(1), condition)
    alone = replace(controls, queries=controls.queries[:, 2:3])
    torch.testing.assert_close(decoder.generate(alone, condition), decoder.generate(controls, condition)[:, 2:3])


def test_frames_of_the_one_shot_transformer_see_each_other_both_ways() -> None:
    decoder = made(partial(OneShotTransformer, layer_input={}, **TRANSFORMER))
    condition = batch((5,)).condition
    controls = made(SinusoidalQueries)(code(1), condition)
    base = decoder.generate(controls, condition)
    for frame, seen in ((0, 4), (4, 0)):
        queries = controls.queries.clone()
        queries[:, frame] += torch.randn(WIDTH, generator=torch.Generator().manual_seed(1))
        changed = decoder.generate(replace(controls, queries=queries), condition)
        assert (changed - base)[:, seen].abs().max() > 1e-4
