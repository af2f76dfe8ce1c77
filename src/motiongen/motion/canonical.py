"""The canonical frame: z up, the reference pose facing -y above the origin (Neural Marionette, Eq. 3-5)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from motiongen.motion.representation import ROOT_ROTATION, TRANSLATION
from motiongen.motion.rotations import yaw_matrix

GROUND = slice(TRANSLATION.start, TRANSLATION.start + 2)
"""The pelvis' position on the floor."""
UPRIGHT = 0.2
"""Below this horizontal length the pelvis' left axis does not tell a heading, and its forward axis is used."""


def heading(features: Tensor) -> Tensor:
    """Yaw (...) in radians of poses (..., 135): 0 faces -y, positive turns left.

    Taken from the pelvis' left axis, which stays level when the body bends forward.
    """
    left, up = features[..., 0:3], features[..., 3:6]
    forward = torch.linalg.cross(left, up)
    from_left = torch.atan2(left[..., 1], left[..., 0])
    from_forward = torch.atan2(forward[..., 0], -forward[..., 1])
    return torch.where(left[..., :2].norm(dim=-1) > UPRIGHT, from_left, from_forward)


@dataclass(frozen=True)
class GroundFrame:
    """A place and a heading on the floor."""

    yaw: Tensor
    """(...) radians"""
    origin: Tensor
    """(..., 2) metres"""

    @classmethod
    def of(cls, pose: Tensor) -> GroundFrame:
        """The frame in which the poses (..., 135) face -y above the origin."""
        return cls(heading(pose), pose[..., GROUND])

    def enter(self, features: Tensor) -> Tensor:
        """World features (..., T, 135) in this frame. Linear in the features, so it is exact for any 6D values."""
        moved = features.clone()
        moved[..., GROUND] -= self.origin.unsqueeze(-2)
        return _turn(moved, -self.yaw)

    def leave(self, features: Tensor) -> Tensor:
        """The inverse of `enter`."""
        moved = _turn(features, self.yaw)
        moved[..., GROUND] += self.origin.unsqueeze(-2)
        return moved

    def leave_ground(self, points: Tensor) -> Tensor:
        """Ground-plane points (..., T, 2) of this frame in the world."""
        return points @ yaw_matrix(self.yaw)[..., :2, :2].transpose(-1, -2) + self.origin.unsqueeze(-2)

    def enter_ground(self, points: Tensor) -> Tensor:
        """World ground-plane points (..., T, 2) in this frame."""
        return (points - self.origin.unsqueeze(-2)) @ yaw_matrix(self.yaw)[..., :2, :2]


def _turn(features: Tensor, yaw: Tensor) -> Tensor:
    """Features (..., T, 135) turned about the world's z axis by yaw (...)."""
    turned = features.clone()
    matrix = yaw_matrix(yaw).to(features).transpose(-1, -2)
    columns = features[..., ROOT_ROTATION].unflatten(-1, (2, 3))
    turned[..., ROOT_ROTATION] = (columns @ matrix.unsqueeze(-3)).flatten(-2)
    turned[..., TRANSLATION] = features[..., TRANSLATION] @ matrix
    return turned
