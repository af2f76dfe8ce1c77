"""The squared error of an SMPL body's vertices, pose-dependent correctives included, as a distance of poses."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from motiongen.contracts import CompositionError
from motiongen.motion.bodies.body import Body
from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import Skeleton
from motiongen.objectives.direct_skinning import Bones, Flesh, bones, error_by_correctives, flesh, squared_error
from motiongen.objectives.vertices import FactoredSkinning


class CorrectedVertices:
    """Mean squared error of the vertices' coordinates relative to the pelvis, square metres.

    It is `Vertices(correctives=True)` without the velocities, and faster, as vertices are compared where they are made;
    the gradient needs about as much memory. With `sampled` it is an estimate without bias. The error of rigid skinning
    is exact, and what the correctives change in it, a few per cent, is estimated on some vertices (a control variate):

        mean_i |dv_i|^2 ~ mean_i |du_i|^2 + mean_{i in sample} (|dv_i|^2 - |du_i|^2)

    with v_i the vertices, u_i those without correctives, d the difference of predicted and true pose.

    Args:
        body: the mesh. It is fitted to the skeleton of the data, so there is one shape, the mean one.
        sampled: vertices that are drawn, without replacement, at every call; all of them by default.
        draws: where they are drawn from; by default torch's generator, which training seeds at every step.

    Raises:
        CompositionError: for a body without correctives, or with fewer vertices than are to be drawn.
    """

    def __init__(self, *, body: Body, sampled: int | None = None, draws: torch.Generator | None = None) -> None:
        if body.pose_directions is None:
            raise CompositionError(
                "CorrectedVertices: this body has no pose-dependent correctives; choose body=smpl, or take Vertices"
            )
        if sampled is not None and not 1 <= sampled <= len(body.rest):
            raise CompositionError(f"CorrectedVertices: sampled={sampled}, but the body has {len(body.rest)} vertices")
        self.body = body
        self.sampled = sampled
        self.draws = draws
        self._fitted: dict[tuple[Skeleton, torch.device], tuple[Body, FactoredSkinning]] = {}

    def __call__(self, predicted: Tensor, target: Tensor, skeleton: Skeleton) -> Tensor:
        """Poses (N, 135) to their errors (N,)."""
        body, factored = self._body(skeleton, predicted.device)
        poses = [(rotations, torch.zeros_like(place)) for rotations, place in map(unpack, (predicted, target))]
        made, wanted = (bones(body, *pose) for pose in poses)
        if self.sampled is None:
            return _mean(squared_error, flesh(body), made, wanted)
        chosen = torch.randperm(len(body.rest), generator=self.draws)[: self.sampled].to(predicted.device)
        numbers, true_numbers = (factored(*pose) for pose in poses)
        rigid = (numbers - true_numbers).square().mean(dim=-1)
        return rigid + _mean(error_by_correctives, flesh(body).some(chosen), made, wanted)

    def _body(self, skeleton: Skeleton, device: torch.device) -> tuple[Body, FactoredSkinning]:
        key = skeleton, device
        if key not in self._fitted:
            # Once and in full precision, whatever the training step that comes first is run in.
            with torch.autocast(self.body.rest.device.type, enabled=False):
                body = self.body.fitted_to(skeleton).to(device)
                self._fitted[key] = body, FactoredSkinning(body)
        return self._fitted[key]


def _mean(error: Callable[[Flesh, Bones, Bones], Tensor], vertices: Flesh, made: Bones, wanted: Bones) -> Tensor:
    """The mean of a squared error over the coordinates of vertices, (N,)."""
    parts = [error(part, made, wanted) for part in vertices.parts(poses=made.bent.shape[1])]
    return torch.stack(parts).sum(dim=0) / (3 * len(vertices.rest))
