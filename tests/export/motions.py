"""A small scene for the tests of pictures and pages."""

from __future__ import annotations

import math

import roma
import torch

from motiongen.export.scene import Scene
from motiongen.motion.bodies import Body, makehuman
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


def tumbling(frames: int = 40, fps: float = 30.0, body: Body | None = None) -> Scene:
    """Every joint turns about an axis of its own, by up to three turns over the whole, while the body travels."""
    draws = torch.Generator().manual_seed(0)
    time = torch.linspace(0, 1, frames)[:, None, None]
    axes = torch.nn.functional.normalize(torch.randn(JOINTS, 3, generator=draws), dim=-1)
    turns = 6 * math.pi * torch.rand(JOINTS, 1, generator=draws)
    begin = roma.rotvec_to_rotmat(torch.randn(JOINTS, 3, generator=draws))
    rotations = begin @ roma.rotvec_to_rotmat(time * turns * axes)
    translation = torch.tensor([0.3, -0.2, 0.9]) + time[:, 0] * torch.tensor([1.0, -2.0, 0.5])
    return Scene("tumble", pack(rotations, translation), body or makehuman(), fps=fps)
