from __future__ import annotations

import pytest
import torch

from motiongen_plugins.motion_denoiser.motion_denoiser import MotionDenoiser


def denoiser(kernel: int = 5, corrupted: float = 0.1) -> MotionDenoiser:
    torch.manual_seed(0)
    return MotionDenoiser(6, width=32, kernel=kernel, corrupted=corrupted, noise=0.5, ready=0.25)


def waves(count: int) -> torch.Tensor:
    """Smooth motion of coupled joints (count, 40, 6)."""
    phase = torch.rand(count, 1, 1) * 6 + torch.arange(6)
    return (torch.arange(40).view(1, 40, 1) / 6 + phase).sin()


def test_it_learns_to_take_noise_away():
    network = denoiser()
    optimizer = torch.optim.Adam(network.parameters(), lr=0.003)
    generator, mask = torch.Generator().manual_seed(0), torch.ones(16, 40, dtype=torch.bool)
    for _ in range(300):
        optimizer.zero_grad()
        network.loss(waves(16), mask, generator).backward()
        optimizer.step()
    clean = waves(16)
    noisy = clean + 0.5 * (torch.rand(clean.shape) < 0.1) * torch.randn(clean.shape)
    left = (network(noisy, mask) - clean).square().mean()
    assert left < 0.5 * (noisy - clean).square().mean()


def test_a_tenth_of_the_numbers_is_corrupted():
    """An identity in place of the layers leaves the noise as the loss: 0.1 x 0.25."""

    class Identity(MotionDenoiser):
        def forward(self, poses, mask):
            return poses

    network = Identity(6, width=8, kernel=3, corrupted=0.1, noise=0.5, ready=0.0)
    poses, mask = torch.zeros(64, 100, 6), torch.ones(64, 100, dtype=torch.bool)
    assert network.loss(poses, mask, torch.Generator().manual_seed(0)).item() == pytest.approx(0.025, rel=0.05)


def test_padding_changes_nothing():
    network, poses = denoiser(), torch.randn(1, 9, 6)
    short = network(poses, torch.ones(1, 9, dtype=torch.bool))
    longer = torch.cat([poses, 100 * torch.randn(1, 11, 6)], dim=1)
    long = network(longer, torch.arange(20).unsqueeze(0) < 9)
    torch.testing.assert_close(short, long[:, :9])
    assert (long[:, 9:] == 0).all()


def test_it_is_used_when_it_is_ready_and_without_gradient():
    network, poses, mask = denoiser(), torch.randn(1, 9, 6), torch.arange(9).unsqueeze(0) < 7
    assert network.clean(poses, mask, 0.2) is poses
    cleaned = network.clean(poses, mask, 0.25)
    assert not cleaned.requires_grad
    assert torch.equal(cleaned[:, :7], network(poses, mask)[:, :7])
    assert torch.equal(cleaned[:, 7:], poses[:, 7:])


def test_an_even_kernel_is_refused():
    with pytest.raises(ValueError, match=r"generator\.denoiser\.kernel is odd, not 4"):
        denoiser(kernel=4)
