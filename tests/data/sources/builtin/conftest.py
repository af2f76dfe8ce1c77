from __future__ import annotations

from collections.abc import Iterable

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
    return posed(corpus)


@pytest.fixture(scope="session")
def takes_31() -> tuple[Take, ...]:
    """Enough sessions, by people of different bodies, for a few performances of the rarest of the 31 tags."""
    return posed(BuiltinSource(sessions=24, repertoire="babel_mag", body_spread=0.08).sequences())


@pytest.fixture(params=["basic", "babel_mag"])
def all_takes(request: pytest.FixtureRequest, takes: tuple[Take, ...], takes_31: tuple[Take, ...]) -> tuple[Take, ...]:
    """Those of one repertoire after the other."""
    return takes if request.param == "basic" else takes_31


def posed(sequences: Iterable[Sequence]) -> tuple[Take, ...]:
    skeleton = BuiltinSource().skeleton()
    made = []
    for sequence in sequences:
        local, translation = unpack(sequence.features.double())
        made.append(Take(sequence, local, *forward_kinematics(local, translation, skeleton)))
    return tuple(made)


@pytest.fixture
def steps(all_takes: tuple[Take, ...]) -> tuple[Tensor, ...]:
    """Rotation of every joint from frame to frame in degrees, (T - 1, 22) for each take."""
    return tuple(
        torch.rad2deg(torch.arccos((((a.mT @ b).diagonal(dim1=-1, dim2=-2).sum(-1) - 1) / 2).clamp(-1, 1)))
        for a, b in ((take.local[:-1], take.local[1:]) for take in all_takes)
    )
