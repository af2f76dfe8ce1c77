"""What is known of an action from the training clips: how long it takes, and how and where it travels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from motiongen.data.datamodule import MotionData
from motiongen.motion.canonical import GROUND
from motiongen.synthesis.paths import DIRECTION_FRAMES, Directions, direction
from motiongen.synthesis.timeline import FPS

SPEED_FRAMES = 15
"""Speeds are means over half a second."""
LEAST_WAY = 0.03
"""Metres within DIRECTION_FRAMES below which a path has no direction yet."""
USUAL_SHARE = 0.95
"""The share of the training clips whose directions count as the range; single clips may start anywhere."""


@dataclass(frozen=True)
class Limits:
    """Of one tag."""

    shortest: float
    """Seconds of the shortest training clip"""
    longest: float
    """Seconds of the longest one"""
    usual_speed: float
    """Metres per second of the pelvis over the floor, the median of the clips' means"""
    top_speed: float
    """Metres per second, the fastest half second of all clips"""
    directions: Directions
    """Where paths begin"""


def limits_of(tag: str, data: MotionData) -> Limits:
    """Measured on the training clips that bear the tag."""
    clips = [clip for clip in data.split.train if tag in _tags(data, clip.sequence, clip.segment)]
    paths = [data.store.features(clip.sequence, clip.start, clip.stop)[:, GROUND] for clip in clips]
    speeds = [_speeds(path) for path in paths]
    return Limits(
        shortest=min(len(clip) for clip in clips) / FPS,
        longest=max(len(clip) for clip in clips) / FPS,
        usual_speed=float(torch.stack([own.mean() for own in speeds]).median()),
        top_speed=max(float(own.max()) for own in speeds),
        directions=_directions(tag, data),
    )


def _directions(tag: str, data: MotionData) -> Directions:
    items = data.train_items()
    own = [index for index, clip in enumerate(items.clips) if tag in _tags(data, clip.sequence, clip.segment)]
    paths = [items[index].trajectory for index in own]
    paths = [path for path in paths if float(path[min(DIRECTION_FRAMES, len(path)) - 1].norm()) >= LEAST_WAY]
    if not paths:
        return Directions(0.0, math.pi)
    angles = torch.tensor([direction(path) for path in paths], dtype=torch.float64)
    middle = float(torch.atan2(angles.sin().mean(), angles.cos().mean()))
    off = torch.remainder(angles - middle + math.pi, 2 * math.pi) - math.pi
    return Directions(middle, float(off.abs().quantile(USUAL_SHARE)))


def _speeds(path: Tensor) -> Tensor:
    """Means over half a second, m/s, of a path (T, 2)."""
    steps = path.diff(dim=0).norm(dim=-1) * FPS
    window = min(SPEED_FRAMES, len(steps))
    return steps.unfold(0, window, 1).mean(dim=-1)


def _tags(data: MotionData, sequence: int, segment: int) -> tuple[str, ...]:
    return data.store.sequences[sequence].segments[segment].tags
