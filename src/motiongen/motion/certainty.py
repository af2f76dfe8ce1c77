"""From the means that generators give to rotations."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.motion.representation import ROTATION, pack, unpack
from motiongen.motion.rotations import share_of
from motiongen.motion.skeleton import JOINTS

SURE = 0.5
"""How long both columns of a 6D rotation are at least, at right angles, where it is taken as it is: as long as those of
the mean of turns by 60 degrees to either side."""


def settle(before: Tensor, motion: Tensor, mask: Tensor) -> Tensor:
    """Generated poses to poses whose rotations are rotations, without a jump where the generator was not sure of them.

    A squared error makes a generator give means. Where several rotations are as likely, as those of a turn to the left
    and to the right, the columns of their mean are short; they pass zero and come out on the other side, and
    Gram-Schmidt alone makes a flip of that. So where columns are shorter than SURE, the rotation goes from the last
    sure one to the next by slerp, slowly at both ends. The pose before the motion and the motion's last one are sure.

    Args:
        before: (B, K, 135), K >= 1, the poses before.
        motion: (B, T, 135) in the same frame.
        mask: (B, T) the frames that count, from the first on.

    Returns:
        (B, T, 135)
    """
    rotations, positions = unpack(motion)
    sure = _shorter_column(motion) >= SURE
    frames = torch.arange(motion.shape[1] + 1, device=motion.device)
    ends = frames[1:] == mask.sum(dim=1, keepdim=True)
    sure = torch.cat([torch.ones_like(sure[:, :1]), sure | ends.unsqueeze(-1)], dim=1)
    if bool(sure.all()):
        return pack(rotations, positions)
    all_rotations = torch.cat([unpack(before[:, -1:])[0], rotations], dim=1)  # (B, 1 + T, 22, 3, 3)
    time = frames[:, None]
    start = torch.where(sure, time, 0).cummax(dim=1).values
    end = torch.where(sure, time, frames[-1]).flip(1).cummin(dim=1).values.flip(1)
    gone = (time - start) / (end - start).clamp(min=1)
    share = gone.square() * (3 - 2 * gone)
    one, other = (torch.take_along_dim(all_rotations, at[..., None, None], dim=1) for at in (start, end))
    between = share_of(other @ one.transpose(-1, -2), share) @ one
    return pack(torch.where(sure[..., None, None], all_rotations, between)[:, 1:], positions)


def _shorter_column(motion: Tensor) -> Tensor:
    """(B, T, 135) to (B, T, 22): the shorter of the first column and of what of the second is at right angles to it."""
    first, second = motion[..., ROTATION].unflatten(-1, (JOINTS, 2, 3)).unbind(-2)
    length = first.norm(dim=-1)
    area = torch.linalg.cross(first, second).norm(dim=-1)
    return torch.minimum(length, area / length)
