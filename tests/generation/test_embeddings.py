from __future__ import annotations

import torch

from motiongen.generation.embeddings import LEAST_DEVIATION, PoseStatistics, Standardize, Unstandardize


def test_statistics_are_those_of_all_frames():
    torch.manual_seed(0)
    short, long = torch.randn(3, 4) + 2, 5 * torch.randn(400, 4)
    short[:, 3] = long[:, 3] = 1.0
    statistics = PoseStatistics.of([short, long])
    frames = torch.cat([short, long])
    torch.testing.assert_close(statistics.mean, frames.mean(0))
    torch.testing.assert_close(statistics.deviation[:3], frames.std(0)[:3])
    assert statistics.deviation[3] == LEAST_DEVIATION


def test_there_and_back():
    torch.manual_seed(0)
    frames = 3 * torch.randn(50, 4) + 1
    statistics = PoseStatistics.of([frames])
    standard = Standardize(statistics)(frames)
    torch.testing.assert_close(standard.mean(0), torch.zeros(4), atol=1e-6, rtol=0)
    torch.testing.assert_close(standard.std(0), torch.ones(4))
    torch.testing.assert_close(Unstandardize(statistics)(standard), frames)
