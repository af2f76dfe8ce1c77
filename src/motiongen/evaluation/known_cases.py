"""Motions whose faults are known, made from the real test clips: what a figure says of them is what it can tell."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from motiongen.contracts import Condition, MotionBatch
from motiongen.evaluation.evaluator import System
from motiongen.evaluation.figures import endless_frechet_distance
from motiongen.evaluation.metrics.frechet import frechet_distance
from motiongen.motion.representation import ROTATION, TRANSLATION

FPS = 30.0
SKATING = 0.05
"""Metres by which the whole body slides to and fro, once a second."""
JITTER = 0.02
"""Standard deviation of the noise on every number of the 6D rotations."""

Fault = Callable[[MotionBatch, torch.Generator], Tensor]


def known_cases(batches: Sequence[MotionBatch]) -> dict[str, System]:
    """A system for every fault, which knows the real clips by the number of their batch."""
    longest = batches[-1]
    one = longest.motion[int(longest.condition.lengths.argmax())]
    faults: dict[str, Fault] = {
        "the same": lambda batch, _: batch.motion,
        "shuffled": shuffled,
        "frozen": frozen,
        "reversed": reversed_in_time,
        "skating": skating,
        "jitter": jittering,
        "one clip": lambda batch, _: one[: batch.motion.shape[1]].expand_as(batch.motion),
    }
    return {name: System(_replay(fault, batches)) for name, fault in faults.items()}


def _replay(fault: Fault, batches: Sequence[MotionBatch]) -> Callable[[Condition, int], Tensor]:
    # The evaluator numbers the batches of all seeds in turn.
    return lambda _, number: fault(batches[number % len(batches)], torch.Generator().manual_seed(number))


def shuffled(batch: MotionBatch, generator: torch.Generator) -> Tensor:
    """Clips change places with others of their length, so that each shows what another was asked for."""
    order = torch.arange(len(batch.motion))
    for length in batch.condition.lengths.unique():
        (places,) = torch.where(batch.condition.lengths == length)
        order[places] = places[torch.randperm(len(places), generator=generator)]
    return batch.motion[order]


def frozen(batch: MotionBatch, _: torch.Generator) -> Tensor:
    """The first pose, held."""
    return batch.motion[:, :1].expand_as(batch.motion)


def reversed_in_time(batch: MotionBatch, _: torch.Generator) -> Tensor:
    """The last frame first."""
    frames = torch.arange(batch.motion.shape[1])
    back = (batch.condition.lengths.unsqueeze(1) - 1 - frames).clamp(min=0)
    return batch.motion.gather(1, back.unsqueeze(-1).expand_as(batch.motion))


def skating(batch: MotionBatch, _: torch.Generator) -> Tensor:
    """The body slides over the floor by SKATING to either side of where it was."""
    motion = batch.motion.clone()
    phase = 2 * math.pi * torch.arange(motion.shape[1]) / FPS
    motion[..., TRANSLATION.start] += SKATING * phase.sin()
    return motion


def jittering(batch: MotionBatch, generator: torch.Generator) -> Tensor:
    """Every joint trembles."""
    motion = batch.motion.clone()
    rotations = motion[..., ROTATION]
    motion[..., ROTATION] = rotations + JITTER * torch.randn(rotations.shape, generator=generator)
    return motion


def real_against_real(features: Tensor, sizes: Sequence[int], draws: int, seed: int) -> list[dict[str, str]]:
    """FID between two disjoint draws of real clips, by their size, and what it extrapolates to: one row a size.

    All of it is bias: the two come from one distribution, whose distance from itself is 0.

    Args:
        features: (M, E) of real clips.
        sizes: of either draw; those that need more clips than there are become half of all.
        draws: pairs a size.
        seed: of the draws.
    """
    generator = torch.Generator().manual_seed(seed)
    half = len(features) // 2
    rows = []
    for size in sorted({min(size, half) for size in [*sizes, half]}):
        found, endless = [], []
        for _ in range(draws):
            order = torch.randperm(len(features), generator=generator)
            one, other = features[order[:size]], features[order[size : 2 * size]]
            found.append(frechet_distance(one, other))
            endless.append(endless_frechet_distance(one, other, generator))
        rows.append({"N": str(size), "FID": _mean(found), "extrapolated FID": _mean(endless)})
    return rows


def _mean(values: Sequence[float]) -> str:
    tensor = torch.tensor(values, dtype=torch.float64)
    if not tensor.isfinite().all():
        return "-"
    return f"{float(tensor.mean()):.3f} ± {1.96 * float(tensor.std()) / math.sqrt(len(values)):.3f}"
