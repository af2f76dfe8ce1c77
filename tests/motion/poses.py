"""Poses that several tests share."""

from __future__ import annotations

import math

import roma
import torch
from torch import Tensor

from motiongen.motion.representation import pack
from motiongen.motion.skeleton import JOINTS


def standing(frames: int) -> Tensor:
    """A T-pose at the origin, facing -y, (frames, 135)."""
    rotations = torch.eye(3).repeat(frames, JOINTS, 1, 1)
    rotations[:, 0] = roma.rotvec_to_rotmat(torch.tensor([math.pi / 2, 0.0, 0.0]))
    return pack(rotations, torch.tensor([0.0, 0.0, 0.9]).repeat(frames, 1))
