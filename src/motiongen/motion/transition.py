"""The slerp that smooths a seam at which a motion does not begin with the pose before it."""

from __future__ import annotations

import roma
import torch
from torch import Tensor

from motiongen.motion.representation import pack, unpack


def smooth_seam(before: Tensor, motion: Tensor, frames: Tensor) -> Tensor:
    """Let the first frames of a motion come from the poses before it.

    What the first pose is off from where the poses before lead, one more frame at their last velocity, is added to the
    motion and fades within `frames`: the rotations by slerp from that difference to none, the position linearly. So
    the motion's own movement goes on from the first frame. Source: Neural Marionette, section 6, which names the slerp.

    Args:
        before: (B, K, 135), K >= 2, the poses before.
        motion: (B, T, 135) in the same frame.
        frames: (B,) how many of them change; 0 changes none.

    Returns:
        (B, T, 135)
    """
    longest = min(int(frames.max()), motion.shape[1])
    if longest == 0:
        return motion
    rotations, positions = unpack(motion[:, :longest])
    (last, last_position), (earlier, earlier_position) = unpack(before[:, -1]), unpack(before[:, -2])
    led_to = last @ earlier.transpose(-1, -2) @ last
    off = roma.rotmat_to_rotvec(led_to @ rotations[:, 0].transpose(-1, -2))  # (B, 22, 3)
    off_position = 2 * last_position - earlier_position - positions[:, 0]  # (B, 3)
    time = torch.arange(longest, dtype=motion.dtype, device=motion.device) / frames.clamp(min=1).unsqueeze(-1)
    time = time.clamp(max=1).masked_fill((frames == 0).unsqueeze(-1), 1.0)
    share = 1 - time.square() * (3 - 2 * time)  # (B, longest) from 1 to 0, level at both ends
    turned = roma.rotvec_to_rotmat(share[..., None, None] * off.unsqueeze(1)) @ rotations
    moved = positions + share.unsqueeze(-1) * off_position.unsqueeze(1)
    changed = torch.where((share > 0).unsqueeze(-1), pack(turned, moved), motion[:, :longest])
    return torch.cat([changed, motion[:, longest:]], dim=1)
