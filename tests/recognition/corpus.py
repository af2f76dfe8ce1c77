"""A corpus of three plain actions that a recognizer tells apart in seconds."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import roma
import torch
from torch import Tensor

from motiongen.data.clips import Segment, Sequence
from motiongen.data.datamodule import MotionData
from motiongen.motion.representation import TRANSLATION, pack, unpack
from motiongen.motion.skeleton import JOINT, JOINTS, Skeleton
from tests.motion.poses import standing

FRAMES = 46
"""Six initial frames and a clip of forty."""


class ThreeActions:
    """`sequences` of each: walking forward, waving the right arm, standing."""

    name = "three_actions"
    root_tags = frozenset({"walk"})

    def __init__(self, *, count: int = 10) -> None:
        self._count = count

    def fingerprint(self) -> str:
        return f"{self._count:08x}"

    def skeleton(self) -> Skeleton:
        offsets = torch.zeros(JOINTS, 3)
        for side, sign in (("left", 1.0), ("right", -1.0)):
            offsets[JOINT[f"{side}_hip"]] = torch.tensor([sign * 0.1, -0.05, 0.0])
            offsets[JOINT[f"{side}_knee"]] = torch.tensor([0.0, -0.4, 0.0])
            offsets[JOINT[f"{side}_ankle"]] = torch.tensor([0.0, -0.4, 0.0])
            offsets[JOINT[f"{side}_foot"]] = torch.tensor([0.0, -0.05, 0.1])
            offsets[JOINT[f"{side}_elbow"]] = torch.tensor([sign * 0.3, 0.0, 0.0])
            offsets[JOINT[f"{side}_wrist"]] = torch.tensor([sign * 0.3, 0.0, 0.0])
        return Skeleton(offsets)

    def __len__(self) -> int:
        return 3 * self._count

    def sequences(self) -> Iterator[Sequence]:
        for number in range(self._count):
            for tag, motion in self._actions(number):
                frames = FRAMES - number
                yield Sequence(f"{tag}_{number}", f"{tag}_{number}", motion[:frames], (Segment(0, frames, (tag,)),))

    def _actions(self, number: int) -> Iterator[tuple[str, Tensor]]:
        time = torch.arange(FRAMES) / 30
        walk = standing(FRAMES)
        walk[:, TRANSLATION][:, 1] = -(1.0 + 0.05 * number) * time
        yield "walk", walk
        yield "wave", _wave(time, math.tau * (0.8 + 0.05 * number))
        share = 0.05 + 0.01 * number
        yield "stand", _wave(time, math.tau * 0.2) * share + standing(FRAMES) * (1 - share)


def _wave(time: Tensor, pace: float) -> Tensor:
    rotations, translation = unpack(standing(len(time)))
    angles = torch.zeros(len(time), 3)
    angles[:, 2] = torch.sin(pace * time)
    rotations[:, JOINT["right_shoulder"]] = roma.rotvec_to_rotmat(angles)
    return pack(rotations, translation)


def three_actions(cache: Path, count: int = 10, seed: int = 0) -> MotionData:
    return MotionData(source=ThreeActions(count=count), cache=str(cache), split_seed=seed, batch_size=4, max_frames=60)
