from __future__ import annotations

import torch
from torch import nn

from motiongen.motion.representation import FEATURES
from motiongen.motion.skeleton import JOINTS, Skeleton
from motiongen.recognition.convolutional import ConvolutionalRecognizer
from motiongen.recognition.signals import body_signals


@torch.no_grad()
def test_it_is_a_plain_stack_of_convolutions_on_every_clip_without_its_padding() -> None:
    torch.manual_seed(0)
    skeleton = Skeleton(torch.randn(JOINTS, 3) * 0.2)
    network = ConvolutionalRecognizer(tags=3, skeleton=skeleton, width=16, feature_width=8).eval()
    plain = nn.Sequential(*(layer for each in network.convolutions for layer in (each, nn.ReLU())))
    plain.extend([nn.AdaptiveAvgPool1d(1), nn.Flatten(), network.to_features])
    assert [type(layer) for layer in plain[:6]] == [nn.Conv1d, nn.ReLU] * 3
    motion, lengths = torch.randn(4, 12, FEATURES), (12, 7, 2, 1)
    found = network(motion, torch.arange(12) < torch.tensor(lengths).unsqueeze(1))
    for clip, length in enumerate(lengths):
        alone, mask = motion[clip : clip + 1, :length], torch.ones(1, length, dtype=torch.bool)
        features = plain(body_signals(alone, mask, skeleton).transpose(1, 2))[0]
        torch.testing.assert_close(found.features[clip], features, atol=1e-5, rtol=1e-5)
        torch.testing.assert_close(found.logits[clip], network.to_logits(features), atol=1e-5, rtol=1e-5)


def test_a_frame_counts_as_far_as_three_kernels_reach() -> None:
    torch.manual_seed(0)
    network = ConvolutionalRecognizer(tags=3, skeleton=Skeleton(torch.zeros(JOINTS, 3)), width=16, kernel=3)
    frames = torch.randn(1, network.convolutions[0].in_channels, 20, requires_grad=True)
    seen = frames
    for convolution in network.convolutions:
        seen = convolution(seen).relu()
    seen[0, :, 10].sum().backward()
    assert frames.grad is not None
    assert frames.grad.any(dim=1)[0].nonzero().flatten().tolist() == list(range(7, 14))
