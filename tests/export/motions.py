"""A small scene for the tests of pictures and pages."""

from __future__ import annotations

import math

import roma
import torch

from motiongen.export.scene import Scene
from motiongen.motion.bodies import makehuman
from motiongen.motion.representation import pack
from motiongen.motion.skeleton import JOINT, JOINTS


def swinging(frames: int = 12, travel: float = 0.0, title: str = "swing") -> Scene:
    """Arms that swing; `travel` metres towards -y."""
    time = torch.linspace(0, 1, frames)
    vectors = torch.zeros(frames, JOINTS, 3)
    vectors[:, 0, 0] = math.pi / 2
    vectors[:, JOINT["left_shoulder"], 2] = -1.2 + time
    vectors[:, JOINT["right_knee"], 0] = time
    translation = torch.stack([torch.zeros(frames), -travel * time, torch.full((frames,), 0.9)], dim=1)
    return Scene(
        title,
        pack(roma.rotvec_to_rotmat(vectors), translation),
        makehuman(),
        initial_frames=3,
        trajectory=translation[:, :2],
        labels=((3, 8, "swing"), (8, frames, "stand")),
    )
