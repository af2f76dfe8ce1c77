"""What a recognizer looks at: the body seen from its pelvis, and how the body moves."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import ROTATION
from motiongen.motion.skeleton import JOINTS, Skeleton

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


def body_signals(motion: Tensor, mask: Tensor, skeleton: Skeleton, fps: float = 30.0) -> Tensor:
    """Canonical motion (B, T, 135) to frames (B, T, SIGNALS) that do not depend on where the body stands.

    Per frame: 21 joints relative to the pelvis and the pelvis' height (metres), then the velocity of all 22 joints
    since the frame before (metres per second; zero in the first frame). Only the past enters, so
    padding at the end cannot.
    """
    joints = joint_positions(fill_padding(motion, mask), skeleton)
    pelvis = joints[..., :1, :]
    velocity = torch.zeros_like(joints)
    velocity[:, 1:] = (joints[:, 1:] - joints[:, :-1]) * fps
    signals = [(joints[..., 1:, :] - pelvis).flatten(-2), pelvis[..., 0, 2:], velocity.flatten(-2)]
    return torch.cat(signals, dim=-1) * mask.unsqueeze(-1)
