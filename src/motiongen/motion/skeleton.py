"""The 22-joint SMPL body layout and the bone offsets of one body."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

JOINT_NAMES = (
    "pelvis",
    "left_hip",
    "right_hip",
    "spine1",
    "left_knee",
    "right_knee",
    "spine2",
    "left_ankle",
    "right_ankle",
    "spine3",
    "left_foot",
    "right_foot",
    "neck",
    "left_collar",
    "right_collar",
    "head",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
)
PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)
"""Parent of every joint; a parent always comes before its children."""
JOINTS = len(JOINT_NAMES)
JOINT = {name: index for index, name in enumerate(JOINT_NAMES)}
FEET = (JOINT["left_ankle"], JOINT["left_foot"], JOINT["right_ankle"], JOINT["right_foot"])


@dataclass(frozen=True)
class Skeleton:
    """Bone offsets of one body in the rest pose.

    The rest pose is SMPL's T-pose in SMPL's axes: x to the left, y up, z forward. A person who stands in the world
    (z up) and faces -y has the root rotation Rx(90 degrees).
    """

    offsets: Tensor
    """(22, 3) metres, each joint from its parent; the pelvis' row is zero."""

    def __post_init__(self) -> None:
        if self.offsets.shape != (JOINTS, 3):
            raise ValueError(f"a skeleton has offsets of shape {(JOINTS, 3)}, not {tuple(self.offsets.shape)}")

    @property
    def leg_length(self) -> float:
        """Mean length of thigh and shank together, metres."""
        legs = self.offsets[[JOINT["left_knee"], JOINT["right_knee"], JOINT["left_ankle"], JOINT["right_ankle"]]]
        return float(legs.norm(dim=-1).sum() / 2)
