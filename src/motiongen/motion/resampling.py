"""Change of frame rate."""

from __future__ import annotations

import roma
import torch
from torch import Tensor


def resample(rotations: Tensor, translation: Tensor, source_fps: float, target_fps: float) -> tuple[Tensor, Tensor]:
    """Resample by slerp (rotations) and linear interpolation (positions); the first frame stays the first.

    Args:
        rotations: (T, J, 3, 3).
        translation: (T, 3).
        source_fps: frames per second of the input; any positive rate, also 59 or 120.00004577.
        target_fps: frames per second of the output.

    Returns:
        The same duration at the target rate: (T', J, 3, 3) and (T', 3) with T' = floor((T - 1) target / source) + 1.

    Raises:
        ValueError: a rate that is not positive, or no frames.
    """
    if source_fps <= 0 or target_fps <= 0:
        raise ValueError(f"frame rates are positive, not {source_fps} and {target_fps}")
    if len(rotations) == 0:
        raise ValueError("no frames to resample")
    last = len(rotations) - 1
    # The small addend keeps the last frame when last * target / source is a whole number but for rounding.
    count = int(last * target_fps / source_fps + 1e-6) + 1
    time = torch.arange(count, dtype=torch.float64) * (source_fps / target_fps)
    before = time.floor().clamp(max=last).long()
    after = (before + 1).clamp(max=last)
    share = (time - before).to(rotations)
    quaternions = roma.rotmat_to_unitquat(rotations)
    start, end = quaternions[before], quaternions[after]
    between = _slerp(start, end, share[:, None])
    position = torch.lerp(translation[before], translation[after], share[:, None].to(translation))
    return roma.unitquat_to_rotmat(between), position


def _slerp(start: Tensor, end: Tensor, share: Tensor) -> Tensor:
    """The short way from start to end, (..., 4) each, at share (..., 1): roma's slerp takes one share for all."""
    relative = roma.quat_product(roma.quat_conjugation(start), end)
    relative = torch.where(relative[..., 3:] < 0, -relative, relative)
    rotvec = roma.unitquat_to_rotvec(relative)
    return roma.quat_product(start, roma.rotvec_to_unitquat(rotvec * share.unsqueeze(-1)))
