"""Systems that are asked for other lengths than those of their windows (UM-CVAE, Fig. 6; ACTOR, Fig. 4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Self

import torch

from motiongen.contracts import Condition, MotionBatch
from motiongen.evaluation.judgement import Judge, Judgement
from motiongen.evaluation.metrics.classification import accuracy
from motiongen.evaluation.metrics.frechet import frechet_distance
from motiongen.evaluation.results import REAL, Estimate, Evaluation

if TYPE_CHECKING:
    from motiongen.data.datamodule import MotionData


@dataclass(frozen=True)
class Length:
    """One length, with what systems are asked and what their motions are compared with."""

    frames: int
    conditions: tuple[Condition, ...]
    """Those of the test batches, for this many frames"""
    real: tuple[MotionBatch, ...]
    """What the FID is to: real test motions of this length or, where one of the actions has none, all test clips"""
    same_length: bool
    """Which of the two"""

    @classmethod
    def of(cls, frames: int, batches: Sequence[MotionBatch], data: MotionData, batch_size: int) -> Self:
        """The length for test clips that come in these batches, on their device."""
        device = batches[0].motion.device
        windows = tuple(batch.to(device) for batch in data.test_windows(frames, batch_size))
        shown = sum((batch.condition.tags.sum(dim=0) for batch in windows), torch.zeros(len(data.tags), device=device))
        conditions = tuple(at_length(batch.condition, frames) for batch in batches)
        has_all = bool(shown.all())
        return cls(frames, conditions, windows if has_all else tuple(batches), has_all)


@dataclass(frozen=True)
class LengthResult:
    """What a system, or the real clips, scored at one length."""

    frames: int
    same_length: bool
    """Whether the FID is to real motions of this length; else it is to the test clips as they are"""
    count: int
    """Real motions that the FID is to"""
    values: dict[str, tuple[float, ...]]
    """`accuracy` and `fid` to one value a seed; real motions have no FID, and nothing where an action has none"""

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        metrics = {name: {**asdict(Estimate.of(own)), "values": list(own)} for name, own in self.values.items()}
        return {"frames": self.frames, "same_length": self.same_length, "count": self.count, "metrics": metrics}


def at_length(condition: Condition, frames: int) -> Condition:
    """The same condition for another number of frames.

    A path is resampled in time: it keeps its place and form, begins at the origin, where the body is before its first
    frame, and ends with the last one, so that its pace changes by T / `frames`.
    """
    lengths = condition.lengths.unsqueeze(1)
    path = torch.cat([torch.zeros_like(condition.trajectory[:, :1]), condition.trajectory], dim=1)
    time = torch.arange(1, frames + 1, device=lengths.device, dtype=torch.float64) * lengths / frames
    before = torch.minimum(time.floor().long(), lengths - 1)
    start, end = (path.gather(1, place.unsqueeze(-1).expand(-1, -1, 2)) for place in (before, before + 1))
    trajectory = torch.lerp(start, end, (time - before).unsqueeze(-1).to(path))
    mask = torch.ones(len(lengths), frames, dtype=torch.bool, device=lengths.device)
    return replace(condition, trajectory=trajectory, mask=mask)


def with_lengths(
    evaluation: Evaluation, judge: Judge, lengths: Sequence[Length], found: Mapping[str, Sequence[Sequence[Judgement]]]
) -> Evaluation:
    """The evaluation with what was scored at these lengths.

    Args:
        evaluation: of the test clips as they are.
        judge: that it was made with.
        lengths: what systems were asked for besides.
        found: for every system and length one judgement a seed.
    """
    results: dict[str, list[LengthResult]] = {name: [] for name in (REAL, *found)}
    for number, length in enumerate(lengths):
        real = Judgement.concatenate(judge(one.motion, one) for one in length.real)
        of_length = partial(LengthResult, length.frames, length.same_length, len(real))
        results[REAL].append(of_length({"accuracy": (accuracy(real.logits, real.tags),)} if length.same_length else {}))
        for name, at_lengths in found.items():
            values = {
                "accuracy": tuple(accuracy(one.logits, one.tags) for one in at_lengths[number]),
                "fid": tuple(frechet_distance(one.features, real.features) for one in at_lengths[number]),
            }
            results[name].append(of_length(values))
    systems = {name: replace(one, lengths=tuple(results.get(name, ()))) for name, one in evaluation.systems.items()}
    return replace(evaluation, systems=systems)
