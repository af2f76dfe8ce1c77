"""What a reconstruction loss compares: functions from pose features (..., F) to the compared numbers (..., Q)."""

from __future__ import annotations

from torch import Tensor

from motiongen.motion.kinematics import forward_kinematics
from motiongen.motion.representation import ROTATION, TRANSLATION, unpack
from motiongen.motion.skeleton import Skeleton


def pose(features: Tensor, skeleton: Skeleton) -> Tensor:
    """P_t: all pose features as they are (ACTOR, section 3.2), (..., F)."""
    return features


def rotation(features: Tensor, skeleton: Skeleton) -> Tensor:
    """R_t: all joints' rotations in 6D form, (..., 132)."""
    return features[..., ROTATION]


def translation(features: Tensor, skeleton: Skeleton) -> Tensor:
    """D_t: the root translation in metres, (..., 3)."""
    return features[..., TRANSLATION]


def local_joints(features: Tensor, skeleton: Skeleton) -> Tensor:
    """J_t: joint positions of the mean shape relative to the root, metres, (..., 66)."""
    rotations, position = unpack(features)
    return forward_kinematics(rotations, position.new_zeros(position.shape), skeleton)[1].flatten(-2)
