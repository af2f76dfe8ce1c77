from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest
import torch
import torch.nn.functional as F
from torch import nn

from motiongen.contracts import CompositionError, MotionBatch
from motiongen.generation.embeddings import Embeddings
from motiongen_plugins.action_agnostic_tcn.action_agnostic_tcn import ActionAgnosticTCN
from tests.compositions import batch
from tests.plugins.um_cvae import DIMENSIONS, TCN


def encoder(**changes) -> ActionAgnosticTCN:
    torch.manual_seed(0)
    return ActionAgnosticTCN(DIMENSIONS, Embeddings(DIMENSIONS), **{**TCN, **changes})


def by_hand(tcn: ActionAgnosticTCN, motion: torch.Tensor, norm_after: int | None) -> tuple[torch.Tensor, torch.Tensor]:
    """Mean and log-variance of one motion (T, F) without padding, by torch's own layers."""
    x = motion.T.unsqueeze(0)
    convolutions = [layer.convolution for layer in tcn.stack if hasattr(layer, "convolution")]
    for number, (layer, dilation) in enumerate(zip(convolutions, (1, 2, 4, 1, 2, 4), strict=True), start=1):
        x = F.relu(F.conv1d(F.pad(x, (dilation, dilation)), layer.weight, layer.bias, dilation=dilation))
        if number == norm_after:
            x = nn.InstanceNorm1d(x.shape[1])(x)
    bounds = [math.ceil(part * len(motion) / tcn.segments) for part in range(tcn.segments + 1)]
    parts = [x[0, :, begin:end] for begin, end in pairwise(bounds)]
    pooled = torch.cat([part.mean(dim=1) if part.shape[1] else torch.zeros(len(part)) for part in parts])
    return tcn.mean(pooled), tcn.log_variance(pooled)


@pytest.mark.parametrize("norm_after", [3, None])
def test_padded_motions_get_what_plain_layers_give_them_alone(norm_after):
    tcn, lengths = encoder(normalize_after=norm_after), (40, 2, 17)
    data = batch(lengths, frames=50)
    dirty = MotionBatch(data.motion + 50 * ~data.condition.mask.unsqueeze(-1), data.condition)
    posterior = tcn.posterior(dirty)
    for row, length in enumerate(lengths):
        mean, log_variance = by_hand(tcn, data.motion[row, :length], norm_after)
        torch.testing.assert_close(posterior.mean[row], mean, atol=1e-5, rtol=1e-4)
        torch.testing.assert_close(posterior.log_variance[row], log_variance, atol=1e-5, rtol=1e-4)


def test_the_code_tells_where_in_a_cycle_a_motion_begins_unless_one_mean_pools_all_of_it():
    """Of eight cycles and the same half a cycle later, one mean differs by what the ends make of it alone."""
    cycle = torch.arange(256 + 16) * 2 * torch.pi / 32
    wave = torch.sin(cycle).unsqueeze(1) * torch.randn(DIMENSIONS.features, generator=torch.Generator().manual_seed(1))
    motions = MotionBatch(torch.stack([wave[:256], wave[16:]]), batch((256, 256)).condition)

    def difference(segments: int) -> torch.Tensor:
        mean = encoder(segments=segments).posterior(motions).mean
        return (mean[0] - mean[1]).norm() / mean.norm()

    assert difference(16) > 5 * difference(1)


def test_a_frame_sees_14_frames_back_and_ahead():
    """Two rounds of kernel 3 with dilation 1, 2, 4 reach 2 * (1 + 2 + 4) frames; positive weights cancel nothing."""
    tcn = encoder(normalize_after=None)
    for parameter in tcn.stack.parameters():
        nn.init.constant_(parameter, 0.05)
    motion = torch.ones(1, 61, DIMENSIONS.features, requires_grad=True)
    frames, mask = motion, torch.ones(1, 61, dtype=torch.bool)
    for layer in tcn.stack:
        frames = layer(frames, mask)
    frames[0, 30].sum().backward()
    reached = motion.grad[0].abs().sum(dim=1).nonzero().flatten().tolist()
    assert reached == list(range(16, 45))


def test_generation_draws_from_the_standard_normal_whatever_the_condition():
    prior = encoder().prior(batch((5, 3)).condition)
    assert prior.mean.shape == prior.log_variance.shape == (2, DIMENSIONS.width)
    assert (prior.mean == 0).all()
    assert (prior.log_variance == 0).all()


def test_the_action_is_not_seen():
    tcn, data = encoder(), batch((9, 9))
    other = MotionBatch(data.motion, replace(data.condition, tags=data.condition.tags.flip(0)))
    assert torch.equal(tcn.posterior(data).mean, tcn.posterior(other).mean)


def test_a_normalisation_without_a_layer_behind_it_is_refused():
    with pytest.raises(CompositionError, match=r"normalize_after \(6\) below layers \(6\)"):
        encoder(normalize_after=6)
