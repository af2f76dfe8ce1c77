"""Skinned bodies on the 22-joint skeleton: the one that ships with motiongen, and SMPL files that a user brings."""

from motiongen.motion.bodies.body import Body
from motiongen.motion.bodies.makehuman import makehuman
from motiongen.motion.bodies.smpl import BodyFileError, smpl

__all__ = ["Body", "BodyFileError", "makehuman", "smpl"]
