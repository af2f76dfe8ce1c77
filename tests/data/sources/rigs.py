"""BVH files of other rigs, written from known motion of SMPL's joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import roma
import torch
from torch import Tensor

from motiongen.motion.skeleton import JOINT, JOINT_NAMES, JOINTS, PARENTS, Skeleton
from tests.data.sources.bvh_files import Joint, write_bvh

CENTER = {
    "hip": (0.09, -0.08, 0.0),
    "knee": (0.0, -0.4, 0.0),
    "ankle": (0.0, -0.41, 0.0),
    "foot": (0.0, -0.06, 0.13),
    "collar": (0.06, 0.1, 0.0),
    "shoulder": (0.11, 0.03, 0.0),
    "elbow": (0.26, 0.0, 0.0),
    "wrist": (0.25, 0.0, 0.0),
    "pelvis": (0.0, 0.0, 0.0),
    "spine1": (0.0, 0.11, 0.0),
    "spine2": (0.0, 0.13, 0.0),
    "spine3": (0.0, 0.06, 0.0),
    "neck": (0.0, 0.21, 0.0),
    "head": (0.0, 0.1, 0.0),
}


def body() -> Skeleton:
    """A body whose limbs are straight in the T-pose."""
    rows = []
    for name in JOINT_NAMES:
        x, y, z = CENTER[name.split("_")[-1]]
        rows.append((-x if name.startswith("right") else x, y, z))
    return Skeleton(torch.tensor(rows))


def motion(frames: int = 90) -> tuple[Tensor, Tensor]:
    """Local rotations (T, 22, 3, 3) and pelvis (T, 3), z up, of a body that stands, arms down, and sways and bends."""
    time = torch.linspace(0, 6, frames, dtype=torch.float64)[:, None]
    draws = torch.Generator().manual_seed(1)
    speed, phase = 1 + torch.rand(2, JOINTS, 3, generator=draws, dtype=torch.float64) * 2
    turns = 0.15 * torch.sin(speed * time[..., None] + phase)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        turns[:, JOINT[f"{side}_shoulder"], 2] -= sign * 1.2
        turns[:, JOINT[f"{side}_elbow"], 1] -= sign * (0.6 + 0.4 * torch.sin(time[:, 0]))
        turns[:, JOINT[f"{side}_knee"], 0] += 0.3
    local = roma.rotvec_to_rotmat(turns)
    upright = roma.rotvec_to_rotmat(torch.tensor([np.pi / 2, 0.0, 0.0], dtype=torch.float64))
    about = roma.rotvec_to_rotmat(torch.cat([0 * time, 0 * time, 0.5 * time], dim=1))
    local[:, 0] = about @ upright @ local[:, 0]
    return local, torch.cat([0.3 * time, -0.2 * time, 0.9 + 0.02 * torch.sin(3 * time)], dim=1)


@dataclass
class RigFile:
    """How a file says it."""

    names: Mapping[str, str | None]
    frames: Tensor = field(default_factory=lambda: torch.eye(3, dtype=torch.float64).repeat(JOINTS, 1, 1))
    """(22, 3, 3) joint frames in the T-pose"""
    up: str = "y"
    unit: float = 1.0
    """metres"""
    order: str = "ZXY"
    between: Mapping[str, str] = field(default_factory=dict)
    """Further joints in the middle of the bone that leads to a joint; they do not turn."""
    fps: float = 30.0

    def write(self, path: Path, local: Tensor, pelvis: Tensor, skeleton: Skeleton) -> Path:
        """`names` may lack only joints whose local rotation is the identity."""
        world = [local[:, 0]]
        for joint in range(1, JOINTS):
            world.append(world[PARENTS[joint]] @ local[:, joint])
        root_from_z_up = torch.tensor([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]], dtype=torch.float64)
        turn = root_from_z_up if self.up == "y" else torch.eye(3, dtype=torch.float64)
        turned = [turn @ rotation @ self.frames[joint] for joint, rotation in enumerate(world)]
        joints: dict[int, Joint] = {}
        values: dict[str, Tensor] = {}
        offsets = skeleton.offsets.double() / self.unit
        rotation_channels = tuple(f"{axis}rotation" for axis in self.order)
        for joint, name in enumerate(JOINT_NAMES):
            given = self.names[name]
            if given is None:
                continue
            if joint == 0:
                position = ("Xposition", "Yposition", "Zposition")
                joints[0] = Joint(given, (0.0, 0.0, 0.0), position + rotation_channels)
                values[given] = torch.cat([pelvis @ turn.T / self.unit, self._angles(turned[0])], dim=1)
                continue
            parent, offset = PARENTS[joint], offsets[joint]
            while parent not in joints:
                parent, offset = PARENTS[parent], offset + offsets[parent]
            offset = self.frames[parent].T @ offset
            above = joints[parent]
            if name in self.between:
                offset = offset / 2
                middle = Joint(self.between[name], tuple(offset.tolist()), rotation_channels)
                values[middle.name] = torch.zeros(len(local), 3, dtype=torch.float64)
                above.children.append(middle)
                above = middle
            joints[joint] = Joint(given, tuple(offset.tolist()), rotation_channels)
            above.children.append(joints[joint])
            values[given] = self._angles(turned[parent].mT @ turned[joint])
        channels = [values[joint.name] for joint in joints[0].walk()]
        return write_bvh(path, joints[0], torch.cat(channels, dim=1).numpy(), 1 / self.fps)

    def _angles(self, rotations: Tensor) -> Tensor:
        return roma.rotmat_to_euler(self.order, rotations, degrees=True)


def along_bones() -> Tensor:
    """(22, 3, 3) frames whose x axis lies along the bone, as in Bandai-Namco's and LAFAN1's files: up the trunk, down
    the left leg, up the right one, out along the left arm, in along the right one; hands and head as the bone before.
    """
    up = torch.tensor([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]], dtype=torch.float64)
    down = torch.tensor([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]], dtype=torch.float64)
    frames = up.repeat(JOINTS, 1, 1)
    for part in ("hip", "knee"):
        frames[JOINT[f"left_{part}"]] = down
        frames[JOINT[f"right_{part}"]] = torch.tensor([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]], dtype=torch.float64)
    for part in ("collar", "shoulder", "elbow", "wrist"):
        frames[JOINT[f"left_{part}"]] = torch.eye(3, dtype=torch.float64)
        frames[JOINT[f"right_{part}"]] = torch.diag(torch.tensor([1.0, -1, -1], dtype=torch.float64))
    for side in ("left", "right"):
        frames[JOINT[f"{side}_ankle"]] = frames[JOINT[f"{side}_foot"]] = frames[JOINT[f"{side}_knee"]]
    return frames


def a_pose() -> Tensor:
    """(22, 3, 3) frames of a rig whose arms hang 45 degrees and whose legs are 10 degrees apart without rotation."""
    frames = torch.eye(3, dtype=torch.float64).repeat(JOINTS, 1, 1)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for parts, degrees in ((("shoulder", "elbow", "wrist"), 45.0), (("hip", "knee"), -10.0)):
            turn = torch.tensor([0.0, 0.0, sign * np.deg2rad(degrees)], dtype=torch.float64)
            for part in parts:
                frames[JOINT[f"{side}_{part}"]] = roma.rotvec_to_rotmat(turn)
    return frames
