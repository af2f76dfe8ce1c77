from __future__ import annotations

import torch

from motiongen.motion.representation import FEATURES
from motiongen.motion.skeleton import JOINTS, Skeleton
from motiongen.recognition.gru import GRURecognizer
from motiongen.recognition.signals import body_signals


@torch.no_grad()
def test_the_code_comes_from_the_state_after_the_last_valid_frame() -> None:
    torch.manual_seed(0)
    skeleton = Skeleton(torch.randn(JOINTS, 3) * 0.2)
    network = GRURecognizer(tags=3, skeleton=skeleton, width=16, feature_width=8).eval()
    motion, lengths = torch.randn(4, 12, FEATURES), (12, 7, 2, 1)
    found = network(motion, torch.arange(12) < torch.tensor(lengths).unsqueeze(1))
    for clip, length in enumerate(lengths):
        alone, mask = motion[clip : clip + 1, :length], torch.ones(1, length, dtype=torch.bool)
        _, last = network.gru(body_signals(alone, mask, skeleton))
        features = network.to_features(last[-1, 0]).tanh()
        torch.testing.assert_close(found.features[clip], features)
        torch.testing.assert_close(found.logits[clip], network.to_logits(features))
