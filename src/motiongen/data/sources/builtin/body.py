"""The bodies of the built-in corpus: bone offsets and the shape of feet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from motiongen.data.sources.builtin.curves import Array
from motiongen.motion.skeleton import JOINT, Skeleton

_OFFSETS = {
    "spine1": (0.0, 0.100, 0.000),
    "spine2": (0.0, 0.112, -0.010),
    "spine3": (0.0, 0.127, -0.038),
    "neck": (0.0, 0.175, 0.040),
    "head": (0.0, 0.075, 0.015),
    "hip": (0.095, -0.045, -0.008),
    "knee": (0.0, -0.410, 0.020),
    "ankle": (0.0, -0.417, -0.035),
    "foot": (0.0, -0.052, 0.135),
    "collar": (0.060, 0.135, 0.036),
    "shoulder": (0.112, -0.035, -0.010),
    "elbow": (0.262, 0.0, 0.0),
    "wrist": (0.238, 0.0, 0.0),
}
"""Metres from the parent joint in SMPL's T-pose (x left, y up, z forward); the right side mirrors x. About 1.70 m tall.
The legs lie in planes of equal x, so that a knee is a hinge about x."""

_TRUNK = ("spine1", "spine2", "spine3", "neck")
_BREADTH = ("collar", "shoulder")
_ARM = ("elbow", "wrist")


@dataclass(frozen=True)
class Body:
    """A person's bones, and the points of the feet from the ankles in the plane of the foot: forward and up. Metres."""

    stature: float = 1.0
    """By which everything is longer or shorter than in the mean body; the others come on top of it."""
    trunk: float = 1.0
    breadth: float = 1.0
    """Of the shoulders."""
    arms: float = 1.0

    def bone(self, part: str) -> Array:
        """(3,) from the parent joint to one of the left side or the middle, by its name without the side."""
        own = {_TRUNK: self.trunk, _BREADTH: self.breadth, _ARM: self.arms}
        share = next((factor for parts, factor in own.items() if part in parts), 1.0)
        return self.stature * share * np.array(_OFFSETS[part])

    def skeleton(self) -> Skeleton:
        """All bones as a `Skeleton`."""
        offsets = torch.zeros(len(JOINT), 3)
        for name, joint in JOINT.items():
            side, _, part = name.rpartition("_")
            if part in _OFFSETS:
                mirror = -1.0 if side == "right" else 1.0
                offsets[joint] = torch.from_numpy(self.bone(part) * np.array([mirror, 1.0, 1.0]))
        return Skeleton(offsets)

    @property
    def ankle_height(self) -> float:
        """The ankle above the floor when the foot is flat."""
        return self.stature * 0.080

    @property
    def ball(self) -> Array:
        return self.stature * np.array([0.135, -0.052])

    @property
    def heel(self) -> Array:
        return self.stature * np.array([-0.055, -0.080])

    @property
    def toe_tip(self) -> Array:
        return self.stature * np.array([0.190, -0.080])

    @property
    def midfoot(self) -> float:
        """The point of the foot that carries a person at rest, before the ankle."""
        return self.stature * 0.040

    @property
    def leg_length(self) -> float:
        """The longest reach of a leg from hip to ankle."""
        return float(np.linalg.norm(self.bone("knee")) + np.linalg.norm(self.bone("ankle")))

    @property
    def standing_height(self) -> float:
        """The pelvis above the floor with straight legs."""
        return float(self.ankle_height - sum(self.bone(part)[1] for part in ("hip", "knee", "ankle")))


MEAN = Body()
"""The body that all motion is shown on."""
