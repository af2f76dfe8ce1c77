"""Joint positions as comma-separated values."""

from __future__ import annotations

import io

import numpy as np

from motiongen.export.scene import Scene
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.skeleton import JOINT_NAMES


def encode_joints(scene: Scene) -> bytes:
    """A table with a row for every frame: `frame`, `time` in seconds, then `<joint>_x`, `_y`, `_z` of the 22 joints.

    Positions are in metres in a world whose z is up, rounded to a micrometre.
    """
    positions = joint_positions(scene.features.detach().cpu().double(), scene.body.to("cpu").skeleton)
    frames = np.arange(scene.frames)
    table = np.column_stack([frames, frames / scene.fps, positions.flatten(1).numpy()])
    header = ["frame", "time", *(f"{joint}_{axis}" for joint in JOINT_NAMES for axis in "xyz")]
    text = io.StringIO(newline="")
    np.savetxt(
        text, table, fmt=["%d", *["%.6f"] * (len(header) - 1)], delimiter=",", header=",".join(header), comments=""
    )
    return text.getvalue().encode()
