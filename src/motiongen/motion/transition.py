"""The slerp that smooths a seam at which a motion does not begin with the pose before it."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.motion.representation import pack, unpack
from motiongen.motion.rotations import share_of


def smooth_seam(before: Tensor, motion: Tensor, frames: Tensor) -> Tensor:
    """Let the first frames of a motion go on from the poses before it, at their velocity.

    The poses before lead to two more frames at their last velocity. What the motion's first two frames are off from
    those is a difference and its change a frame; a cubic Hermite curve takes both to zero within `frames` and is added
    to the motion: to the rotations by slerp (Neural Marionette, section 6), to the position as it is. Neither the pose
    nor its velocity jumps, as in inertialization (Bollo 2018).

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
    first_rotations, first_positions = unpack(motion[:, :2])
    (last, last_position), (earlier, earlier_position) = unpack(before[:, -1]), unpack(before[:, -2])
    turn, step = last @ earlier.transpose(-1, -2), last_position - earlier_position
    ahead = range(1, first_positions.shape[1] + 1)
    led_to = torch.stack([torch.linalg.matrix_power(turn, frame) @ last for frame in ahead], dim=1)
    led_to_position = torch.stack([last_position + frame * step for frame in ahead], dim=1)
    off = led_to @ first_rotations.transpose(-1, -2)  # (B, 2, 22, 3, 3)
    off_position = led_to_position - first_positions  # (B, 2, 3)
    change, change_position = off[:, -1] @ off[:, 0].transpose(-1, -2), off_position[:, -1] - off_position[:, 0]
    time = torch.arange(longest, dtype=motion.dtype, device=motion.device) / frames.clamp(min=1).unsqueeze(-1)
    time = time.clamp(max=1).masked_fill((frames == 0).unsqueeze(-1), 1.0)
    share = (1 - time).square() * (1 + 2 * time)  # (B, longest) from 1 to 0, level at both ends
    change_share = frames.unsqueeze(-1) * time * (1 - time).square()  # from 0, by 1 a frame, back to 0
    turned = (
        share_of(change.unsqueeze(1), change_share.unsqueeze(-1))
        @ share_of(off[:, :1], share.unsqueeze(-1))
        @ rotations
    )
    moved = (
        positions
        + share.unsqueeze(-1) * off_position[:, :1]
        + change_share.unsqueeze(-1) * change_position.unsqueeze(1)
    )
    changed = torch.where((time < 1).unsqueeze(-1), pack(turned, moved), motion[:, :longest])
    return torch.cat([changed, motion[:, longest:]], dim=1)
