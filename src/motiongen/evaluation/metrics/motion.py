"""Errors and physical quantities of motions. One number a clip, over valid frames only; padding never enters."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.motion.skeleton import FEET

CONTACT_MARGIN = 0.02
"""Metres that a foot joint may be above its resting height and still count as in contact with the floor."""


def trajectory_error(position: Tensor, trajectory: Tensor, mask: Tensor) -> Tensor:
    """Distance between the root on the ground plane and the trajectory that was asked for, mean over valid frames.

    position (B, T, 2) and trajectory (B, T, 2) in the condition's canonical frame, mask (B, T), to (B,). Unit: metres.
    Range 0 to infinity, lower is better. Meaningful only for clips whose trajectory is specified. Source: Neural
    Marionette, section 5.1.2.
    """
    return valid_mean((position - trajectory).norm(dim=-1), mask)


def joint_position_error(joints: Tensor, reference: Tensor, mask: Tensor) -> Tensor:
    """Distance between generated and real joints, mean over joints and valid frames.

    joints and reference (B, T, J, 3) in metres, mask (B, T), to (B,). Unit: centimetres. Range 0 to infinity, lower is
    better, though a condition has more than one right answer. The protocol passes joints in the condition's canonical
    frame, root travel included, on the mean skeleton of the data. Source: Neural Marionette, Table 2.
    """
    return valid_mean((joints - reference).norm(dim=-1).mean(dim=-1), mask) * 100


def joint_speed(joints: Tensor, mask: Tensor, fps: float = 30.0) -> Tensor:
    """Speed of the joints, mean over joints and valid frames.

    joints (B, T, J, 3) in metres, mask (B, T), to (B,); NaN for clips of one frame. Unit: metres per second. Range 0 to
    infinity; best near the speed of real clips of the action: far below it the motion is frozen, far above it jitters.
    """
    return valid_mean(*_steps(joints, mask)) * fps


def frozen_share(joints: Tensor, mask: Tensor, threshold: float, fps: float = 30.0) -> Tensor:
    """How much of the time the body does not move: the share of frame pairs of lower joint speed.

    joints (B, T, J, 3) in metres, mask (B, T), threshold in metres per second, to (B,) float64: the share of pairs of
    successive valid frames between which the speed, mean over joints, is below the threshold; NaN for clips of one
    frame. No unit, range 0 to 1; best near the share of real clips of the action, as some actions hold still. A mean
    speed hides a clip that moves at first and then freezes, as autoregressive generators do; this does not. No paper's:
    defined here.
    """
    step, valid = _steps(joints, mask)
    return valid_mean(step * fps < threshold, valid)


def resting_heights(joints: Tensor, mask: Tensor) -> Tensor:
    """Height of every joint of FEET while the foot stands flat: (B, T, 22, 3), mask (B, T) to (F,) metres.

    The tenth percentile over all valid frames: bodies differ by centimetres in how high their ankle and toe joints are,
    and even runners have a foot on the floor more often than that.
    """
    return torch.quantile(joints[mask][:, list(FEET), 2], 0.1, dim=0)


def foot_skating(joints: Tensor, mask: Tensor, resting: Tensor) -> Tensor:
    """Horizontal speed of the ankles and toes that are in contact with the floor.

    joints (B, T, 22, 3) in metres, mask (B, T), resting (F,) from `resting_heights` of real motion, to (B,); NaN for
    clips without contact. A joint is in contact between two valid frames if in both it is under CONTACT_MARGIN above
    its resting height. Unit: centimetres per frame. Range 0 to infinity, lower is better; real clips are above 0, as
    feet roll, so compare with theirs.
    """
    feet = joints[:, :, list(FEET)]
    low = (feet[..., 2] < resting + CONTACT_MARGIN) & mask.unsqueeze(-1)
    speed = (feet[:, 1:, :, :2] - feet[:, :-1, :, :2]).norm(dim=-1)
    return valid_mean(speed.flatten(1), (low[:, 1:] & low[:, :-1]).flatten(1)) * 100


def valid_mean(values: Tensor, valid: Tensor) -> Tensor:
    """Mean of each row (B, N) over its valid entries in float64; NaN where there are none."""
    kept = values.double().masked_fill(~valid, 0.0)
    return kept.sum(dim=1) / valid.sum(dim=1)


def _steps(joints: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
    """Mean way of the joints from frame to frame (B, T - 1), and where both frames are valid (B, T - 1)."""
    return (joints[:, 1:] - joints[:, :-1]).norm(dim=-1).mean(dim=-1), mask[:, 1:] & mask[:, :-1]
