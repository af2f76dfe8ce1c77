"""Long motions made of actions: how smooth the seams between them are, and how many actions are recognized."""

from __future__ import annotations

from torch import Tensor

from motiongen.evaluation.metrics.classification import hits
from motiongen.evaluation.metrics.motion import valid_mean


def pose_gap(joints_before: Tensor, joints_after: Tensor) -> Tensor:
    """Distance between the last pose of an action and the first pose of the next, mean over joints.

    joints_before (B, K, J, 3) ends at the seam and joints_after (B, L, J, 3) begins there, both in one world frame,
    metres, without padding at the seam, to (B,) float64. Unit: centimetres. Range 0 to infinity; a lower one is usually
    smoother, but as the poses are a frame apart, best near the step of one frame in real motion. Source: Neural
    Marionette, section 5.2.2.

    Raises:
        ValueError: a side without a frame, or joints of different shapes.
    """
    _require_sides(joints_before, joints_after, frames=1)
    return (joints_after[:, 0] - joints_before[:, -1]).double().norm(dim=-1).mean(dim=-1) * 100


def velocity_gap(joints_before: Tensor, joints_after: Tensor) -> Tensor:
    """Difference between the joints' velocities at the end of an action and at the start of the next, mean over joints.

    joints_before (B, K, J, 3) ends at the seam and joints_after (B, L, J, 3) begins there, metres, to (B,) float64: the
    norm of (after_1 - after_0) - (before_K - before_(K-1)). The step across the seam itself is not in it; `pose_gap`
    measures that one. Unit: centimetres per frame. Range 0 to infinity, lower is better; best near the value at any two
    neighbouring steps of real motion. Source: Neural Marionette, section 5.2.2.

    Raises:
        ValueError: a side of fewer than two frames, or joints of different shapes.
    """
    _require_sides(joints_before, joints_after, frames=2)
    before, after = joints_before.double(), joints_after.double()
    change = (after[:, 1] - after[:, 0]) - (before[:, -1] - before[:, -2])
    return change.norm(dim=-1).mean(dim=-1) * 100


def qualified_actions(logits: Tensor, tags: Tensor, mask: Tensor) -> Tensor:
    """Which actions of long motions are recognized: the most likely tag is one of the action's tags.

    logits (M, N, A) of M motions of up to N actions, multi-hot tags (M, N, A), mask (M, N) True where there is an
    action to judge, to bool (M, N), False outside of the mask. Source: Neural Marionette, section 5.2.2.
    """
    return hits(logits, tags) & mask


def action_qualification_ratio(logits: Tensor, tags: Tensor, mask: Tensor) -> float:
    """Action QR: the share of a motion's actions that are recognized, mean over motions.

    logits (M, N, A), multi-hot tags (M, N, A), mask (M, N) as in `qualified_actions`. Every motion counts once, however
    many actions it has. No unit, range 0 to 1, higher is better. The paper leaves the first action of every motion out,
    as its initial frames are real: its mask is False there. Source: Neural Marionette, section 5.2.2.

    Raises:
        ValueError: no motion, or one without an action.
    """
    _require_actions(mask)
    return float(valid_mean(qualified_actions(logits, tags, mask), mask).mean())


def motion_qualification_ratio(logits: Tensor, tags: Tensor, mask: Tensor) -> float:
    """Motion QR: the share of motions all of whose actions are recognized.

    logits (M, N, A), multi-hot tags (M, N, A), mask (M, N) as in `qualified_actions`. No unit, range 0 to 1, never
    above the action QR, higher is better. Source: Neural Marionette, section 5.2.2, Eq. 7.

    Raises:
        ValueError: no motion, or one without an action.
    """
    _require_actions(mask)
    return float((qualified_actions(logits, tags, mask) | ~mask).all(dim=1).double().mean())


def _require_sides(joints_before: Tensor, joints_after: Tensor, frames: int) -> None:
    before, after = joints_before.shape, joints_after.shape
    if before[:1] + before[2:] != after[:1] + after[2:] or min(before[1], after[1]) < frames:
        raise ValueError(f"no seam with {frames} frames on both sides lies between {tuple(before)} and {tuple(after)}")


def _require_actions(mask: Tensor) -> None:
    if not len(mask) or not mask.any(dim=1).all():
        raise ValueError("the qualification ratio is of motions with at least 1 action each")
