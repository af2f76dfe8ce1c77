"""The training objective: named, unweighted terms, and the one place where weights meet them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import torch
from torch import Tensor

from motiongen.contracts import MotionBatch, Prediction
from motiongen.motion.skeleton import Skeleton
from motiongen.objectives.terms import kl_to_standard_normal, mean_over_frames, squared_error, velocity_error
from motiongen.options import NonNegativeFloat

FIRST_PASS = "first_pass/"
VELOCITY = "_velocity"
KL = "kl"


class Quantity(Protocol):
    """What a reconstruction term compares."""

    def __call__(self, features: Tensor, skeleton: Skeleton) -> Tensor: ...


class Distance(Protocol):
    """A reconstruction term that is not a squared error."""

    def __call__(self, predicted: Tensor, target: Tensor, skeleton: Skeleton) -> Tensor:
        """Predicted and true poses (V, F) to distances (V,)."""
        ...


class Objective:
    """Reconstruction of several quantities with their velocities, for one or two passes, and KL.

    Neural Marionette, Eq. 1 and 2:
        L_Recon(P) = sum over quantities q of weights[q] * (MSE(q) + velocity * MSE(frame differences of q))
        L = first_pass * L_Recon(P') + last_pass * L_Recon(P'') + weights[kl] * KL
    and L = L_Recon(P') + weights[kl] * KL while there is one pass only. A distance d adds weights[d] * mean(d) to
    L_Recon. Terms that the generator itself gives are added, each with its weight.

    Args:
        quantities: name -> function of the pose features.
        weights: one weight for each quantity and distance, for `kl` and for each of the generator's own terms.
        velocity: weight of a quantity's frame differences (lambda_V).
        first_pass, last_pass: lambda_1 and lambda_2, used when the training scheme made two passes.
        distances: name -> distance of predicted and true poses, averaged over the valid frames as quantities are.
        ramps: name of a weight -> its share of the weight, a function of the run's progress; without one it is 1.

    Raises:
        ValueError: a quantity without weight, or a ramp of no weight; in `total`, a term without weight, or a weight
            that belongs to no term.
    """

    def __init__(
        self,
        *,
        quantities: Mapping[str, Quantity],
        weights: Mapping[str, float],
        velocity: NonNegativeFloat,
        first_pass: NonNegativeFloat,
        last_pass: NonNegativeFloat,
        distances: Mapping[str, Distance] | None = None,
        ramps: Mapping[str, Callable[[float], float]] | None = None,
    ) -> None:
        if missing := {*quantities, *(distances or {}), KL} - set(weights):
            raise ValueError(f"objective.weights lacks {', '.join(sorted(missing))}")
        if unknown := set(ramps or {}) - set(weights):
            raise ValueError(f"objective.ramps names {', '.join(sorted(unknown))}, which objective.weights does not")
        self.quantities = dict(quantities)
        self.distances = dict(distances or {})
        self.weights = dict(weights)
        self.ramps = dict(ramps or {})
        self.velocity = velocity
        self.passes = (first_pass, last_pass)

    def terms(self, prediction: Prediction, batch: MotionBatch, skeleton: Skeleton) -> dict[str, Tensor]:
        """Unweighted scalars: `rotation`, `rotation_velocity`, ..., `kl`, and `first_pass/...` for a first pass.

        Velocities are left out where their weight is zero.
        """
        targets = {name: quantity(batch.motion, skeleton) for name, quantity in self.quantities.items()}
        mask = batch.condition.mask
        named = self._reconstruction(prediction.motion, targets, mask, skeleton)
        named |= self._distances(prediction.motion, batch.motion, mask, skeleton)
        if prediction.first_pass is not None:
            first = self._reconstruction(prediction.first_pass, targets, mask, skeleton)
            first |= self._distances(prediction.first_pass, batch.motion, mask, skeleton)
            named |= {FIRST_PASS + name: value for name, value in first.items()}
        if prediction.posterior is not None:
            named[KL] = kl_to_standard_normal(prediction.posterior)
        return named | dict(prediction.terms)

    def total(self, terms: Mapping[str, Tensor], progress: float) -> Tensor:
        """The weighted sum of what `terms` returned, at `progress` in [0, 1] of the run."""
        if unused := set(self.weights) - {*map(_weight_of, terms), KL}:
            raise ValueError(f"objective.weights names {', '.join(sorted(unused))}, which this generator does not give")
        shares = self.passes if any(name.startswith(FIRST_PASS) for name in terms) else (0.0, 1.0)
        weighted = []
        for name, value in terms.items():
            weight = _weight_of(name)
            if weight not in self.weights:
                raise ValueError(f"objective.weights lacks {weight}, a term of this generator")
            factor = self.weights[weight] * (self.ramps[weight](progress) if weight in self.ramps else 1.0)
            if weight in self.quantities or weight in self.distances:
                factor *= shares[0] if name.startswith(FIRST_PASS) else shares[1]
                factor *= self.velocity if name.endswith(VELOCITY) else 1.0
            weighted.append(factor * value)
        return torch.stack(weighted).sum()

    def _reconstruction(
        self, motion: Tensor, targets: Mapping[str, Tensor], mask: Tensor, skeleton: Skeleton
    ) -> dict[str, Tensor]:
        named: dict[str, Tensor] = {}
        for name, target in targets.items():
            predicted = self.quantities[name](motion, skeleton)
            named[name] = squared_error(predicted, target, mask)
            if self.velocity:
                named[name + VELOCITY] = velocity_error(predicted, target, mask)
        return named

    def _distances(self, motion: Tensor, target: Tensor, mask: Tensor, skeleton: Skeleton) -> dict[str, Tensor]:
        named: dict[str, Tensor] = {}
        for name, distance in self.distances.items():
            # Valid frames alone: a padded pose is no rotation, and would make the gradient of the others no number.
            valid = distance(motion[mask], target[mask], skeleton)
            named[name] = mean_over_frames(valid.new_zeros(mask.shape).masked_scatter(mask, valid), mask)
        return named


def _weight_of(term: str) -> str:
    return term.removeprefix(FIRST_PASS).removesuffix(VELOCITY)
