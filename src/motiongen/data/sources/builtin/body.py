"""The one body of the built-in corpus: bone offsets, the shape of its feet, the limits of its joints."""

from __future__ import annotations

import numpy as np
import torch

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

ANKLE_HEIGHT = 0.080
"""The ankle above the floor when the foot is flat, metres."""
BALL = np.array([0.135, -0.052])
HEEL = np.array([-0.055, -0.080])
TOE_TIP = np.array([0.190, -0.080])
"""Points of the flat foot from the ankle: forward and up, metres."""
MIDFOOT = 0.040
"""The point of the foot that carries a person at rest, metres before the ankle."""
THIGH = np.array(_OFFSETS["knee"])
SHANK = np.array(_OFFSETS["ankle"])
HIP = np.array(_OFFSETS["hip"])
HIP_TO_ANKLE = float(np.linalg.norm(THIGH) + np.linalg.norm(SHANK))
"""The longest reach of a leg, metres."""
STANDING_HEIGHT = float(ANKLE_HEIGHT - THIGH[1] - SHANK[1] - HIP[1])
"""The pelvis above the floor with straight legs, metres."""


def skeleton() -> Skeleton:
    """The offsets as a `Skeleton`."""
    offsets = torch.zeros(len(JOINT), 3)
    for name, joint in JOINT.items():
        side, _, part = name.rpartition("_")
        if part in _OFFSETS:
            mirror = -1.0 if side == "right" else 1.0
            x, y, z = _OFFSETS[part]
            offsets[joint] = torch.tensor([mirror * x, y, z])
    return Skeleton(offsets)
