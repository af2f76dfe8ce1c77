"""Distances between rotations, and the hierarchical loss over a pose (Ghorbani et al. 2020, section 3.5.1).

Run as a module, it prints the impact factors of the built-in body: `python -m motiongen.objectives.geodesic`.
"""

from __future__ import annotations

from typing import Literal

import roma
import torch
from torch import Tensor

from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import JOINT_NAMES, PARENTS, Skeleton
from motiongen.options import NonNegativeFloat

CLOSEST = 1.0 - 1e-6
"""Cosines are clamped to this: the gradient of arccos has no bound at 1. It stands for an angle of 0.16 degrees."""


def angle(one: Tensor, other: Tensor) -> Tensor:
    """2 arccos |q . q'| of unit quaternions (..., 4): the angle between the rotations in radians, (...) (Eq. 17)."""
    return 2 * _dot(one, other).clamp(max=CLOSEST).arccos()


def cosine(one: Tensor, other: Tensor) -> Tensor:
    """1 - |q . q'| of unit quaternions (..., 4), (...): 1 - cos(angle / 2) (Eq. 18)."""
    return 1 - _dot(one, other)


def smaller_norm(one: Tensor, other: Tensor) -> Tensor:
    """min(|q - q'|^2, |q + q'|^2) of quaternions (..., 4), (...) (Eq. 20).

    Squared as in Eq. 19, from which the paper derives it; of unit quaternions it is twice the `cosine`.
    """
    return torch.minimum((one - other).square().sum(dim=-1), (one + other).square().sum(dim=-1))


def matrix_angle(one: Tensor, other: Tensor) -> Tensor:
    """Size of log(R' R^T) as the angle in radians, of rotation matrices (..., 3, 3), (...) (Eq. 21)."""
    trace = (one * other).sum(dim=(-1, -2))
    return ((trace - 1) / 2).clamp(-CLOSEST, CLOSEST).arccos()


QUATERNION_FORMS = {"angle": angle, "cosine": cosine, "norm": smaller_norm}


def impact_factors(skeleton: Skeleton, end_effector: float = 0.0) -> Tensor:
    """Alpha of Eq. 23, (22,): the longest path in metres from each joint down to an end effector.

    Args:
        skeleton: its bones.
        end_effector: alpha of the joints without children, which the equation leaves at 0.
    """
    lengths = skeleton.offsets.norm(dim=-1).tolist()
    longest = [end_effector if joint not in PARENTS else 0.0 for joint in range(len(PARENTS))]
    for joint, parent in reversed(list(enumerate(PARENTS))[1:]):
        longest[parent] = max(longest[parent], longest[joint] + lengths[joint])
    return torch.tensor(longest)


class HierarchicalGeodesic:
    """sum over joints k of alpha_k d(q_k, q'_k), for every frame (Eq. 22).

    Args:
        form: d: `angle` (Eq. 17), `cosine` (Eq. 18), `norm` (Eq. 20) or `matrix` (Eq. 21).
        hierarchical: alpha of Eq. 23; without it alpha is 1 (the paper's ablation NL).
        end_effector: alpha of the joints without children, metres. Eq. 23 gives them 0, so that head, wrists and toes
            would never be trained: this is about the length of what hangs on them.
        root: whether the pelvis' rotation in the world is compared too.
    """

    def __init__(
        self,
        *,
        form: Literal["angle", "cosine", "norm", "matrix"] = "angle",
        hierarchical: bool = True,
        end_effector: NonNegativeFloat = 0.1,
        root: bool = False,
    ) -> None:
        self.form = form
        self.hierarchical = hierarchical
        self.end_effector = end_effector
        self.first = 0 if root else 1

    def __call__(self, predicted: Tensor, target: Tensor, skeleton: Skeleton) -> Tensor:
        """Poses (V, 135) to their distances (V,): metres for the angles, as alpha is in metres."""
        distances = self._distances(unpack(predicted)[0][:, self.first :], unpack(target)[0][:, self.first :])
        if not self.hierarchical:
            return distances.sum(dim=-1)
        return distances @ impact_factors(skeleton, self.end_effector)[self.first :].to(distances)

    def _distances(self, predicted: Tensor, target: Tensor) -> Tensor:
        """Rotations (V, J, 3, 3) to distances (V, J)."""
        if self.form == "matrix":
            return matrix_angle(predicted, target)
        return QUATERNION_FORMS[self.form](roma.rotmat_to_unitquat(predicted), roma.rotmat_to_unitquat(target))


def _dot(one: Tensor, other: Tensor) -> Tensor:
    """|q . q'|: q and -q are one rotation."""
    return (one * other).sum(dim=-1).abs()


if __name__ == "__main__":
    from motiongen.data.sources.builtin.body import MEAN

    body = MEAN.skeleton()
    for name, printed, used in zip(JOINT_NAMES, impact_factors(body), impact_factors(body, 0.1), strict=True):
        print(f"{name:15} {printed:.3f} m (Eq. 23)   {used:.3f} m (with 0.1 m beyond end effectors)")
