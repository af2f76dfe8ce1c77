"""Poses that do not depend on where the body stands and where it faces (Ghorbani et al. 2020, section 3.1)."""

from __future__ import annotations

import math

import roma
import torch
from torch import Tensor

from motiongen.generation.pose_forms import RotationForm
from motiongen.motion.representation import pack, unpack
from motiongen.motion.rotations import yaw_matrix
from motiongen.motion.skeleton import JOINTS

FPS = 30.0
ROOT = slice(0, 6)
"""Forward and sideways (left) velocity, m/s; height, m; yaw rate, rad/s; pitch and roll, rad."""
PITCH_AND_ROLL = slice(4, 6)
STANDING = ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
"""The root rotation of a body that stands upright and faces -y: 90 degrees about x."""


class RootVelocity:
    """6 values of the root, then the local rotations of the other 21 joints in a form of k numbers: P = 6 + 21 k.

    Motion starts from the origin, facing -y, which is where the frame before it is in the canonical frame; the paper
    faces x.

    Args:
        form: of the joints' rotations.
    """

    def __init__(self, form: RotationForm) -> None:
        self.form = form
        self.width = ROOT.stop + (JOINTS - 1) * form.numbers

    def encode(self, features: Tensor) -> Tensor:
        """Features (B, T, 135) of canonical motion to poses (B, T, P)."""
        rotations, position = unpack(features.float())
        joints = self.form.of_matrices(rotations[..., 1:, :, :])
        return torch.cat([root_values(rotations[..., 0, :, :], position), joints.flatten(-2)], dim=-1)

    def normalize(self, raw: Tensor) -> Tensor:
        """A network's output (B, T, P) to poses (B, T, P), with rotations as `encode` would give them."""
        # In single precision from here on: what follows is added up over the motion.
        raw = raw.float()
        joints = self.form.of_matrices(self.form.to_matrices(self._joints(raw)))
        return torch.cat([raw[..., ROOT], joints.flatten(-2)], dim=-1)

    def decode(self, poses: Tensor) -> Tensor:
        """Poses (B, T, P) to features (B, T, 135): the inverse of `encode`."""
        root, position = integrated(poses[..., ROOT])
        joints = self.form.to_matrices(self._joints(poses))
        return pack(torch.cat([root.unsqueeze(-3), joints], dim=-3), position)

    def violation(self, raw: Tensor) -> Tensor:
        """How far a network's output (B, T, P) is from valid rotations, summed over the joints: (B, T)."""
        return self.form.violation(self._joints(raw.float())).sum(dim=-1)

    def _joints(self, poses: Tensor) -> Tensor:
        """(B, T, 21, k)"""
        return poses[..., ROOT.stop :].unflatten(-1, (JOINTS - 1, self.form.numbers))


def root_distance(one: Tensor, other: Tensor) -> Tensor:
    """Sum of the root values' absolute differences, of poses (B, T, P): (B, T).

    The paper's loss speaks of the joints alone; this is the same kind of measure, metres and radians unsquared.
    """
    difference = one[..., ROOT] - other[..., ROOT]
    straight, angles = difference[..., : PITCH_AND_ROLL.start], wrapped(difference[..., PITCH_AND_ROLL])
    return straight.abs().sum(dim=-1) + angles.abs().sum(dim=-1)


def root_values(rotation: Tensor, position: Tensor) -> Tensor:
    """Root rotations (..., T, 3, 3) and positions (..., T, 3) in the world to root values (..., T, 6).

    The body's rotation out of upright is Rz(yaw) Ry(roll) Rx(pitch): yaw is the heading of its left axis, which stays
    level when it bends forward, as in the canonical frame. Velocities are backward differences, the first from the
    origin and yaw 0, and are seen along the heading of their own frame.
    """
    upright = rotation @ rotation.new_tensor(STANDING).T
    yaw, roll, pitch = roma.rotmat_to_euler("ZYX", upright).unbind(dim=-1)
    turn = wrapped(yaw.diff(dim=-1, prepend=torch.zeros_like(yaw[..., :1])))
    ground, height = position[..., :2], position[..., 2]
    step = ground.diff(dim=-2, prepend=torch.zeros_like(ground[..., :1, :]))
    # A row vector times Rz(yaw) is the step seen along the heading: x to the left, y to the back.
    left, back = (step.unsqueeze(-2) @ yaw_matrix(yaw)[..., :2, :2]).squeeze(-2).unbind(dim=-1)
    return torch.stack([-back * FPS, left * FPS, height, turn * FPS, pitch, roll], dim=-1)


def integrated(values: Tensor) -> tuple[Tensor, Tensor]:
    """The inverse of `root_values`: (..., T, 6) to root rotations (..., T, 3, 3) and positions (..., T, 3)."""
    forward, left, height, turn, pitch, roll = values.unbind(dim=-1)
    yaw = (turn / FPS).cumsum(dim=-1)
    upright = roma.euler_to_rotmat("ZYX", torch.stack([yaw, roll, pitch], dim=-1))
    step = torch.stack([left, -forward], dim=-1) / FPS
    ground = (yaw_matrix(yaw)[..., :2, :2] @ step.unsqueeze(-1)).squeeze(-1).cumsum(dim=-2)
    return upright @ values.new_tensor(STANDING), torch.cat([ground, height.unsqueeze(-1)], dim=-1)


def wrapped(angle: Tensor) -> Tensor:
    """Radians to [-pi, pi)."""
    return (angle + math.pi).remainder(2 * math.pi) - math.pi
