"""Training steps of MARIONET with scheduled sampling at a ratio of one half, for every frame that is no padding.

Reference: random batches, time first, joints by 4 x 4 matrices. Ours: batches of similar lengths, as the data module
forms them. Dropout is on in what is timed and off where the losses of one batch are compared.

Both go once through the same motions of 20 to 150 frames: those of a few batches, short ones to long ones, of an epoch.
The fewer the motions to choose from, the less alike are the most alike, so the epoch is a data set's, as is the padding
that is stated.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import torch
from torch import Tensor

from benchmarks.measuring import Effort, floor, interleaved
from benchmarks.reference import kinematics
from benchmarks.reference.transformers import PlainMarionet
from benchmarks.results import Comparison, Figure, Result, relative_error
from benchmarks.rows.actor_training import PRECISIONS, our_loss, step
from benchmarks.subjects import body, composition, motion_batch
from motiongen.contracts import MotionBatch
from motiongen.data.dataset import bucketed
from motiongen.motion.representation import ROTATION, TRANSLATION
from motiongen.motion.skeleton import JOINTS

TITLE = "MARIONET training, batch 30, 20 to 150 frames, scheduled sampling, per useful frame"
TARGETS = {"32": 3.0, "bf16": 5.0}
TIMED = 3
"""Batches"""
PROGRESS = 0.5
"""Of the run: half of the second pass' frames are predicted ones."""
WEIGHTS = {"rotation": 1.0, "translation": 0.5, "joints": 2.0}
VELOCITY, FIRST_PASS, LAST_PASS, KL = 2.0, 0.1, 0.9, 1e-8


def plain_loss(model: PlainMarionet, batch: MotionBatch) -> Tensor:
    """Neural Marionette, Eq. 1 and 2, on all frames, padded ones masked at the end."""
    draws = torch.Generator().manual_seed(0)
    condition, mask = batch.condition, batch.condition.mask
    noise = torch.randn(len(mask), model.mean.out_features, generator=draws)
    controls, mean, spread = model.controls(condition, noise)
    past = batch.past.permute(1, 0, 2)
    first = model.decode(past, controls, mask)
    predicted = torch.cat((past[:1], first[:-1].detach()), dim=0)
    chosen = torch.rand(mask.shape, generator=draws) < PROGRESS
    second = model.decode(torch.where(chosen.T.unsqueeze(-1), predicted, past), controls, mask)
    kl = -0.5 * torch.sum(1 + spread - mean.pow(2) - spread.exp(), dim=1).mean()
    losses = [_reconstruction(made.permute(1, 0, 2), batch) for made in (first, second)]
    return FIRST_PASS * losses[0] + LAST_PASS * losses[1] + KL * kl


def _reconstruction(made: Tensor, batch: MotionBatch) -> Tensor:
    mask = batch.condition.mask.unsqueeze(-1).float()
    total = made.new_zeros(())
    for name, weight in WEIGHTS.items():
        ours, true = _quantity(name, made), _quantity(name, batch.motion)
        total = total + weight * _masked(ours - true, mask)
        total = total + weight * VELOCITY * _masked((ours - true).diff(dim=1), mask[:, 1:] * mask[:, :-1])
    return total


def _quantity(name: str, motion: Tensor) -> Tensor:
    if name == "rotation":
        return motion[..., ROTATION]
    if name == "translation":
        return motion[..., TRANSLATION]
    rotations = kinematics.rotation_from_6d(motion[..., ROTATION].reshape(-1, JOINTS, 6))
    return kinematics.posed_joints(rotations, body(1).rest_joints).reshape(*motion.shape[:2], -1)


def _masked(error: Tensor, mask: Tensor) -> Tensor:
    return ((error.pow(2).mean(dim=-1, keepdim=True) * mask).sum(dim=(1, 2)) / mask.sum(dim=(1, 2)).clamp(min=1)).mean()


def measure(effort: Effort) -> list[Result]:
    generator, objective = composition("marionette", effort)
    size, epoch = effort.size(30, 3), effort.size(1500, 12)
    rng = np.random.default_rng(0)
    lengths = rng.integers(effort.size(20, 2), effort.size(150, 8), epoch, endpoint=True)
    buckets = sorted(bucketed(lengths.tolist(), size, rng), key=lambda bucket: lengths[bucket].max())
    timed = buckets[len(buckets) // (2 * TIMED) :: len(buckets) // TIMED][:TIMED]
    order = rng.permutation(np.concatenate(timed))
    mixed = [motion_batch(lengths[chosen].tolist()) for chosen in np.split(order, TIMED)]
    similar = [motion_batch(lengths[chosen].tolist()) for chosen in timed]
    model = PlainMarionet(generator.eval())
    loss = partial(our_loss, generator, objective, skinned=body(1), progress=PROGRESS)
    errors = {
        name: relative_error(loss(batch=mixed[0], autocast=name == "bf16"), plain_loss(model, mixed[0]))
        for name in PRECISIONS
    }
    generator.train()
    model.train()
    plain_optimizer = torch.optim.Adam(model.parameters(), lr=1e-4)
    optimizer = torch.optim.Adam(generator.parameters(), lr=1e-4)

    def plain_epoch() -> None:
        for batch in mixed:
            step(partial(plain_loss, model, batch), plain_optimizer)

    def our_epoch(autocast: bool) -> None:
        for batch in similar:
            step(partial(loss, batch=batch, autocast=autocast), optimizer)

    epochs: dict[str, Callable[[], None]] = {
        "reference": plain_epoch,
        **{name: partial(our_epoch, name == "bf16") for name in PRECISIONS},
    }
    taken = interleaved(epochs, effort)
    found: list[Result] = [
        Comparison(
            name,
            taken["reference"],
            taken[precision],
            error=errors[precision],
            tolerance=tolerance,
            target=TARGETS[precision],
            floor=floor(epochs[precision], effort, dtype),
            made=(float(lengths[order].sum()), "useful frames"),
        )
        for precision, (name, dtype, tolerance) in PRECISIONS.items()
    ]
    random = np.array_split(rng.permutation(epoch), epoch // size)
    for name, batches in (("random batches", random), ("batches of similar lengths", buckets)):
        padded = sum(len(batch) * lengths[batch].max() for batch in batches)
        found.append(Figure(f"padding in {name}", 100 * float(1 - lengths.sum() / padded), "%"))
    return found
