"""The squared error of a body's vertices as a reconstruction quantity (ACTOR, section 3.3, L_V)."""

from __future__ import annotations

from collections.abc import Iterator

import torch
from torch import Tensor

from motiongen.contracts import CompositionError
from motiongen.motion.bodies.body import Body
from motiongen.motion.kinematics import forward_kinematics
from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import JOINTS, Skeleton

NULL = 1e-12
"""A direction of transforms with a smaller share of the largest eigenvalue moves no vertex."""

TOGETHER = 2**16
"""Vertices times poses that are skinned at once: what is worked out for them stays in the processor's cache."""


class Vertices:
    """Numbers whose mean squared difference is that of the vertices' coordinates, in square metres.

    Args:
        body: the mesh. It is fitted to the skeleton of the data, so there is one shape, the mean one (ACTOR).
        correctives: skin every vertex with the pose-dependent corrections that an SMPL body has, at a cost in time and
            memory in proportion to the vertices; otherwise they are left out and `FactoredSkinning` does the work.
        translation: compare the vertices where they are in the world; otherwise the pelvis is the origin (ACTOR).

    Raises:
        CompositionError: `correctives` for a body that has none.
    """

    def __init__(self, *, body: Body, correctives: bool = False, translation: bool = False) -> None:
        if correctives and body.pose_directions is None:
            raise CompositionError(
                "Vertices: correctives=true would have no effect, since this body has no pose-dependent correctives; "
                "choose body=smpl, or leave it out"
            )
        self.body = body
        self.skinning = DirectSkinning if correctives else FactoredSkinning
        self.translation = translation
        self._fitted: dict[tuple[Skeleton, torch.device], DirectSkinning | FactoredSkinning] = {}

    def __call__(self, features: Tensor, skeleton: Skeleton) -> Tensor:
        """Features (..., 135) to (..., Q)."""
        key = skeleton, features.device
        if key not in self._fitted:
            # Once and in full precision, whatever the training step that comes first is run in.
            with torch.autocast(self.body.rest.device.type, enabled=False):
                self._fitted[key] = self.skinning(self.body.fitted_to(skeleton).to(features.device))
        rotations, position = unpack(features)
        return self._fitted[key](rotations, position if self.translation else torch.zeros_like(position))


class DirectSkinning:
    """The vertices themselves."""

    def __init__(self, body: Body) -> None:
        self.body = body

    def __call__(self, rotations: Tensor, position: Tensor) -> Tensor:
        """Local rotations (..., 22, 3, 3) and pelvis positions (..., 3) to (..., 3V), metres."""
        poses = position.shape[:-1]
        numbers = torch.cat(list(self.parts(rotations.reshape(-1, JOINTS, 3, 3), position.reshape(-1, 3))))
        return numbers.movedim(-1, 0).reshape(*poses, 3 * len(self.body.rest))

    def parts(self, rotations: Tensor, position: Tensor) -> Iterator[Tensor]:
        """(3v, N) of some vertices after others, metres: `Body.vertices` with the poses last.

        Args:
            rotations: (N, 22, 3, 3) local.
            position: (N, 3) of the pelvis.
        """
        body, count = self.body, len(position)
        world, moved = body.transforms(rotations, position)
        columns = [world[..., axis].movedim(0, -1).flatten(1) for axis in range(3)]  # (22, 3N) each
        shift = moved.movedim(0, -1).flatten(1)
        bent = (rotations[:, 1:] - torch.eye(3).to(rotations)).flatten(1).T.contiguous()
        size = max(1, TOGETHER // max(1, count))
        for start in range(0, len(body.rest), size):
            some = slice(start, start + size)
            weights, rest = body.weights[some], body.rest[some].reshape(-1, 1)
            if body.pose_directions is not None:
                rest = torch.addmm(rest, body.pose_directions[some].flatten(0, 1), bent)
            place = rest.unflatten(0, (-1, 3))  # (v, 3, N or 1)
            posed = (weights @ shift).unflatten(1, (3, count))
            for axis, column in enumerate(columns):
                posed = torch.addcmul(posed, place[:, axis, None], (weights @ column).unflatten(1, (3, count)))
            yield posed.flatten(0, 1)


class FactoredSkinning:
    """A few hundred numbers with the mean square of thousands of vertices, exact for rigid skinning.

    Under linear blend skinning a vertex is linear in the joints' transforms A_j = [R_j, p_j] (3 x 4):

        v_i = sum_j w_ij (R_j (r_i - c_j) + p_j) = A x_i,   A = [A_1 ... A_J],   x_i = [w_ij (r_i - c_j), w_ij]_j

    with vertices r_i and joints c_j of the rest pose. So the error of all vertices is a quadratic form in the
    difference of the transforms, whose Gram matrix (4J x 4J) follows from the body alone:

        sum_i |dA x_i|^2 = tr(dA G dA^T) = |dA L|^2,   G = sum_i x_i x_i^T = L L^T
    """

    def __init__(self, body: Body) -> None:
        self.skeleton = body.skeleton
        self.factor = vertex_factor(body)

    def __call__(self, rotations: Tensor, position: Tensor) -> Tensor:
        """A L: local rotations (..., 22, 3, 3) and pelvis positions (..., 3) to (..., 3 * rank)."""
        world, joints = forward_kinematics(rotations, position, self.skeleton)
        transforms = torch.cat([world, joints.unsqueeze(-1)], dim=-1)  # (..., J, 3, 4)
        return (transforms.transpose(-3, -2).flatten(-2) @ self.factor.to(transforms)).flatten(-2)


def vertex_factor(body: Body) -> Tensor:
    """L, (4J, rank), with |dA L|^2 / (3 rank) the mean square of the vertices' 3V coordinates.

    Worked out in float64, returned in the body's own type; transforms that move no vertex are left out.
    """
    rest, joints, weights = body.rest.double(), body.rest_joints.double(), body.weights.double()
    arms = torch.cat([rest[:, None] - joints, torch.ones(len(rest), JOINTS, 1).to(rest)], dim=-1)  # (V, J, 4)
    x = (weights.unsqueeze(-1) * arms).flatten(1)
    values, directions = torch.linalg.eigh(x.T @ x)
    kept = values > NULL * values[-1]
    factor = directions[:, kept] * values[kept].sqrt()
    return (factor * (factor.shape[1] / len(rest)) ** 0.5).to(body.rest)
