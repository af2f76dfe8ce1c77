"""Paths on the floor for actions that travel: recorded ones, and those that a user draws."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import torch
from torch import Tensor

from motiongen.motion.canonical import GroundFrame

DIRECTION_FRAMES = 6
"""How many frames of a path tell its direction (Neural Marionette, supplement 5.2)."""
DENSE = 64
"""Points on a drawn line between two that the user gave."""


@dataclass(frozen=True)
class Directions:
    """The directions in which the paths of an action begin, in the canonical frame."""

    middle: float
    """Radians, 0 straight ahead, positive to the left"""
    spread: float
    """Radians to either side of it, 0 to pi"""

    def outside(self, angle: float) -> float:
        """By how much, and to which side, an angle leaves the range: 0 within it."""
        off = math.remainder(angle - self.middle, 2 * math.pi)
        return off - max(-self.spread, min(self.spread, off))


class RootPath(Protocol):
    """Where an action's root is to go."""

    def place(self, beginning: GroundFrame) -> Tensor:
        """The path (T, 2) in the world for an action that begins in this place."""
        ...


@dataclass(frozen=True)
class RecordedPath:
    """A path that goes along with the body, wherever the action begins."""

    points: Tensor
    """(T, 2) in the canonical frame of the pose before the action, metres"""

    def place(self, beginning: GroundFrame) -> Tensor:
        return beginning.leave_ground(self.points)


@dataclass(frozen=True)
class DrawnPath:
    """A path that begins where the body is and keeps its direction in the world."""

    points: Tensor
    """(T, 2) metres, from the place before the first frame"""

    def place(self, beginning: GroundFrame) -> Tensor:
        return beginning.origin + self.points


@dataclass(frozen=True)
class PlacedPath:
    """A path that has its place in the world. A body that begins beside it comes back to it by the action's end."""

    start: Tensor
    """(2,) metres: where the body should be before the first frame"""
    points: Tensor
    """(T, 2) metres, from `start`"""

    def place(self, beginning: GroundFrame) -> Tensor:
        count = len(self.points)
        done = torch.arange(1, count + 1, dtype=self.points.dtype, device=self.points.device) / count
        return self.points + torch.lerp(beginning.origin, self.start, done.unsqueeze(-1))


def fit_path(path: Tensor, frames: int) -> Tensor:
    """A recorded path (T, 2), cut to `frames` or continued at the mean velocity of its last half second (15 frames)."""
    if len(path) >= frames:
        return path[:frames]
    tail = path[-16:]
    velocity = (tail[-1] - tail[0]) / max(1, len(tail) - 1)
    ahead = torch.arange(1, frames - len(path) + 1, dtype=path.dtype, device=path.device).unsqueeze(-1)
    return torch.cat([path, path[-1] + ahead * velocity])


def fit_bezier(points: Tensor) -> Tensor:
    """Control points (4, 2) of the cubic Bezier curve that is nearest to points (N, 2), N >= 2, in least squares.

    The curve begins at the first point and ends at the last; a point's parameter is its share of the way along the
    line. Where there are too few points to tell, the curve is that which bends least. Source: Neural Marionette,
    supplement 5.2.
    """
    first, last = points[0], points[-1]
    straight = torch.stack([torch.lerp(first, last, third / 3) for third in range(4)])
    basis = _bernstein(_shares(points))
    bend = torch.linalg.pinv(basis[:, 1:3]) @ (points - basis @ straight)
    return torch.cat([straight[:1], straight[1:3] + bend, straight[3:]])


def sample_bezier(control: Tensor, frames: int) -> Tensor:
    """Positions (T, 2) of control points (4, 2) at t = n / T, n = 1 .. T (supplement, Eq. 1)."""
    time = torch.arange(1, frames + 1, dtype=control.dtype, device=control.device) / frames
    return _bernstein(time) @ control


def cut_line(points: Tensor, shares: list[float]) -> list[Tensor]:
    """The line through points (N, 2), cut into pieces whose lengths are these shares of it; each (DENSE or more, 2).

    Between the points the line is a centripetal Catmull-Rom spline, so that it has no corners to turn at.
    """
    dense = _smooth(points)
    along = _shares(dense)
    ends = torch.tensor([0.0, *torch.tensor(shares).cumsum(0).tolist()], dtype=dense.dtype)
    ends = ends / ends[-1]
    pieces = []
    for start, stop in pairwise(ends):
        inside = dense[(along > start) & (along < stop)]
        pieces.append(torch.cat([_at(dense, along, start), inside, _at(dense, along, stop)]))
    return pieces


def direction(path: Tensor) -> float:
    """Where a path (T, 2) from the origin leads at first: radians, 0 along -y, positive to the left."""
    x, y = path[min(DIRECTION_FRAMES, len(path)) - 1].tolist()
    return math.atan2(x, -y)


def length(path: Tensor) -> float:
    """The length of the way (T, 2) from the origin of its frame, metres."""
    return float(torch.cat([path.new_zeros(1, 2), path]).diff(dim=0).norm(dim=-1).sum())


def _bernstein(time: Tensor) -> Tensor:
    """(N,) in [0, 1] to the weights of the four control points, (N, 4)."""
    rest = 1 - time
    return torch.stack([rest**3, 3 * rest**2 * time, 3 * rest * time**2, time**3], dim=-1)


def _shares(points: Tensor) -> Tensor:
    """How far along the line each of its points lies, (N,) from 0 to 1."""
    steps = points.diff(dim=0).norm(dim=-1)
    along = torch.cat([steps.new_zeros(1), steps.cumsum(0)])
    return along / along[-1]


def _at(points: Tensor, along: Tensor, share: Tensor) -> Tensor:
    """The point (1, 2) at a share of the way."""
    after = int(torch.searchsorted(along, share).clamp(1, len(along) - 1))
    before = after - 1
    part = (share - along[before]) / (along[after] - along[before]).clamp(min=1e-12)
    return torch.lerp(points[before], points[after], part).unsqueeze(0)


def _smooth(points: Tensor) -> Tensor:
    """DENSE points for every stretch of a line (N, 2) (Barry and Goldman 1988; Yuksel et al. 2011)."""
    ends = torch.cat([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    knots = torch.cat([points.new_zeros(1), ends.diff(dim=0).norm(dim=-1).sqrt().clamp(min=1e-6).cumsum(0)])
    stretches = []
    for index in range(len(points) - 1):
        (p0, p1, p2, p3), (t0, t1, t2, t3) = ends[index : index + 4], knots[index : index + 4]
        t = torch.linspace(float(t1), float(t2), DENSE + 1, dtype=points.dtype)[:-1].unsqueeze(-1)
        a1 = (t1 - t) / (t1 - t0) * p0 + (t - t0) / (t1 - t0) * p1
        a2 = (t2 - t) / (t2 - t1) * p1 + (t - t1) / (t2 - t1) * p2
        a3 = (t3 - t) / (t3 - t2) * p2 + (t - t2) / (t3 - t2) * p3
        b1 = (t2 - t) / (t2 - t0) * a1 + (t - t0) / (t2 - t0) * a2
        b2 = (t3 - t) / (t3 - t1) * a2 + (t - t1) / (t3 - t1) * a3
        stretches.append((t2 - t) / (t2 - t1) * b1 + (t - t1) / (t2 - t1) * b2)
    return torch.cat([*stretches, points[-1:]])
