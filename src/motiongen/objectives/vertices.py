"""The squared error of a body's vertices as a reconstruction quantity (ACTOR, section 3.3, L_V)."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.contracts import CompositionError
from motiongen.motion.bodies.body import Body
from motiongen.motion.kinematics import forward_kinematics
from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import JOINTS, Skeleton
from motiongen.objectives.compiling import compiled as compiled_function
from motiongen.objectives.direct_skinning import bones, flesh, skinned

NULL = 1e-12
"""A direction of transforms with a smaller share of the largest eigenvalue moves no vertex."""


class Vertices:
    """Numbers whose mean squared difference is that of the vertices' coordinates, in square metres.

    Args:
        body: the mesh. It is fitted to the skeleton of the data, so there is one shape, the mean one (ACTOR).
        correctives: skin every vertex with the pose-dependent corrections that an SMPL body has, at a cost in time and
            memory in proportion to the vertices; otherwise they are left out and `FactoredSkinning` does the work.
        translation: compare the vertices where they are in the world; otherwise the pelvis is the origin (ACTOR).
        compiled: by `torch.compile`, which takes a minute or two at the first steps and halves the time of later ones;
            not together with `correctives`, whose loop over vertices it would unroll.

    Raises:
        CompositionError: `correctives` for a body that has none or together with `compiled`, or no C++ compiler.
    """

    def __init__(
        self, *, body: Body, correctives: bool = False, translation: bool = False, compiled: bool = False
    ) -> None:
        if correctives and body.pose_directions is None:
            raise CompositionError(
                "Vertices: correctives=true would have no effect, since this body has no pose-dependent correctives; "
                "choose body=smpl, or leave it out"
            )
        if correctives and compiled:
            raise CompositionError(
                "Vertices: compiled=true is for rigid skinning; leave out correctives=true, or take CorrectedVertices"
            )
        self.body = body
        self.numbers = compiled_function(_numbers) if compiled else _numbers
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
        return self.numbers(self._fitted[key], features, self.translation)


def _numbers(skinning: DirectSkinning | FactoredSkinning, features: Tensor, translation: bool) -> Tensor:
    rotations, position = unpack(features)
    return skinning(rotations, position if translation else torch.zeros_like(position))


class DirectSkinning:
    """The vertices themselves."""

    def __init__(self, body: Body) -> None:
        self.body = body

    def __call__(self, rotations: Tensor, position: Tensor) -> Tensor:
        """Local rotations (..., 22, 3, 3) and pelvis positions (..., 3) to (..., 3V), metres."""
        poses = position.shape[:-1]
        posed = bones(self.body, rotations.reshape(-1, JOINTS, 3, 3), position.reshape(-1, 3))
        numbers = torch.cat([skinned(part, posed).flatten(0, 1) for part in flesh(self.body).parts(poses.numel())])
        return numbers.movedim(-1, 0).reshape(*poses, 3 * len(self.body.rest))


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
