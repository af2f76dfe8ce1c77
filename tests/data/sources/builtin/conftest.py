from __future__ import annotations

import pytest
import torch
from torch import Tensor

from motiongen.data.clips import Sequence
from motiongen.data.sources.builtin.source import BuiltinSource
from motiongen.motion.kinematics import forward_kinematics
from motiongen.motion.representation import unpack
from tests.data.sources.builtin.takes import Take


@pytest.fixture(scope="session")
def corpus() -> tuple[Sequence, ...]:
    return tuple(BuiltinSource().sequences())


@pytest.fixture(scope="session")
def takes(corpus: tuple[Sequence, ...]) -> tuple[Take, ...]:
    skeleton = BuiltinSource().skeleton()
    made = []
    for sequence in corpus:
        local, translation = unpack(sequence.features.double())
        made.append(Take(sequence, local, *forward_kinematics(local, translation, skeleton)))
    return tuple(made)


@pytest.fixture(scope="session")
def steps(takes: tuple[Take, ...]) -> tuple[Tensor, ...]:
    """Rotation of every joint from frame to frame in degrees, (T - 1, 22) for each take."""
    return tuple(
        torch.rad2deg(torch.arccos((((a.mT @ b).diagonal(dim1=-1, dim2=-2).sum(-1) - 1) / 2).clamp(-1, 1)))
        for a, b in ((take.local[:-1], take.local[1:]) for take in takes)
    )
