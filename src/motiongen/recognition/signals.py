"""What a recognizer looks at: the body seen from its pelvis, and how the body moves."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import ROTATION
from motiongen.motion.skeleton import JOINTS, Skeleton

FPS = 30.0
"""Frames a second of the motion that recognizers are given."""
JOINT_SIGNALS = 6
"""Numbers in a joint of `joint_signals`."""
SIGNALS = (JOINTS - 1) * 3 + 1 + JOINTS * 3
"""Numbers in a frame of `body_signals`."""


def fill_padding(motion: Tensor, mask: Tensor) -> Tensor:
    """Replace padded frames of (B, T, 135) by the rest pose, whatever they hold.

    Padding is zero and a zero 6D rotation has no Gram-Schmidt form: its NaN would spread through attention, and through
    gradients even where the value itself is masked.
    """
    rest = torch.zeros_like(motion[0, 0])
    rest[ROTATION] = torch.tensor([1.0, 0.0, 0.0, 0.0, 1.0, 0.0]).to(rest).repeat(JOINTS)
    return torch.where(mask.unsqueeze(-1), motion, rest)


def joint_signals(motion: Tensor, mask: Tensor, skeleton: Skeleton, fps: float = FPS) -> Tensor:
    """Canonical motion (B, T, 135) to joints (B, T, 22, JOINT_SIGNALS) that do not depend on where the body stands.

    Per joint: its place relative to the pelvis (metres), the pelvis' own being (0, 0, its height), then its velocity
    since the frame before (metres per second; zero in the first frame). Only the past enters, so
    padding at the end cannot. Padded frames are zero.
    """
    joints = joint_positions(fill_padding(motion, mask), skeleton)
    pelvis = joints[..., :1, :]
    height = pelvis * torch.tensor([0.0, 0.0, 1.0]).to(pelvis)
    place = torch.cat([height, joints[..., 1:, :] - pelvis], dim=-2)
    velocity = torch.zeros_like(joints)
    velocity[:, 1:] = (joints[:, 1:] - joints[:, :-1]) * fps
    return torch.cat([place, velocity], dim=-1) * mask[..., None, None]


def body_signals(motion: Tensor, mask: Tensor, skeleton: Skeleton, fps: float = FPS) -> Tensor:
    """`joint_signals` as frames (B, T, SIGNALS).

    Per frame: 21 joints relative to the pelvis and the pelvis' height, then the velocity of all 22 joints.
    """
    place, velocity = joint_signals(motion, mask, skeleton, fps).split(3, dim=-1)
    return torch.cat([place[..., 1:, :].flatten(-2), place[..., 0, 2:], velocity.flatten(-2)], dim=-1)
