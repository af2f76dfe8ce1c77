"""The training objective: named, unweighted terms, and the one place where weights meet them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import torch
from torch import Tensor

from motiongen.contracts import MotionBatch, Prediction
from motiongen.motion.skeleton import Skeleton
from motiongen.objectives.terms import kl_to_standard_normal, squared_error, velocity_error
from motiongen.options import NonNegativeFloat

FIRST_PASS = "first_pass/"
KL = "kl"


class Quantity(Protocol):
    """What a reconstruction term compares."""

    def __call__(self, features: Tensor, skeleton: Skeleton) -> Tensor: ...


class Objective:
    """Reconstruction of several quantities with their velocities, for one or two passes, and KL.

    Neural Marionette, Eq. 1 and 2:
        L_Recon(P) = sum over quantities q of weights[q] * (MSE(q) + velocity * MSE(frame differences of q))
        L = first_pass * L_Recon(P') + last_pass * L_Recon(P'') + weights[kl] * KL
    and L = L_Recon(P') + weights[kl] * KL while there is one pass only.

    Args:
        quantities: name -> function of the pose features.
        weights: one weight for each quantity, and `kl`.
        velocity: weight of a quantity's frame differences (lambda_V).
        first_pass, last_pass: lambda_1 and lambda_2, used when the training scheme made two passes.

    Raises:
        ValueError: weights that do not belong to the quantities.
    """

    def __init__(
        self,
        *,
        quantities: Mapping[str, Quantity],
        weights: Mapping[str, float],
        velocity: NonNegativeFloat,
        first_pass: NonNegativeFloat,
        last_pass: NonNegativeFloat,
    ) -> None:
        wanted = {*quantities, KL}
        if wanted != set(weights):
            raise ValueError(f"objective.weights must name exactly {sorted(wanted)}, not {sorted(weights)}")
        self.quantities = dict(quantities)
        self.weights = dict(weights)
        self.velocity = velocity
        self.passes = (first_pass, last_pass)

    def terms(self, prediction: Prediction, batch: MotionBatch, skeleton: Skeleton) -> dict[str, Tensor]:
        """Unweighted scalars: `rotation`, `rotation_velocity`, ..., `kl`, and `first_pass/...` for a first pass."""
        targets = {name: quantity(batch.motion, skeleton) for name, quantity in self.quantities.items()}
        mask = batch.condition.mask
        named = self._reconstruction(prediction.motion, targets, mask, skeleton)
        if prediction.first_pass is not None:
            first = self._reconstruction(prediction.first_pass, targets, mask, skeleton)
            named |= {FIRST_PASS + name: value for name, value in first.items()}
        if prediction.posterior is not None:
            named[KL] = kl_to_standard_normal(prediction.posterior)
        return named

    def total(self, terms: Mapping[str, Tensor]) -> Tensor:
        """The weighted sum of what `terms` returned."""
        first, last = self.passes if any(name.startswith(FIRST_PASS) for name in terms) else (0.0, 1.0)
        weighted = []
        for name, value in terms.items():
            if name == KL:
                weighted.append(self.weights[KL] * value)
                continue
            share = first if name.startswith(FIRST_PASS) else last
            quantity = name.removeprefix(FIRST_PASS)
            order = self.velocity if quantity.endswith("_velocity") else 1.0
            weighted.append(share * order * self.weights[quantity.removesuffix("_velocity")] * value)
        return torch.stack(weighted).sum()

    def _reconstruction(
        self, motion: Tensor, targets: Mapping[str, Tensor], mask: Tensor, skeleton: Skeleton
    ) -> dict[str, Tensor]:
        named: dict[str, Tensor] = {}
        for name, target in targets.items():
            predicted = self.quantities[name](motion, skeleton)
            named[name] = squared_error(predicted, target, mask)
            named[f"{name}_velocity"] = velocity_error(predicted, target, mask)
        return named
