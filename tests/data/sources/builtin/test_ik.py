from __future__ import annotations

import numpy as np
import torch

from motiongen.data.sources.builtin.body import MEAN
from motiongen.data.sources.builtin.ik import solve
from motiongen.data.sources.builtin.score import CHANNELS
from motiongen.motion.kinematics import forward_kinematics
from motiongen.motion.skeleton import JOINT


def pose(frames: int, **channels: np.ndarray | float) -> torch.Tensor:
    """Joint positions (T, 22, 3) of a body that stands but for what is given."""
    curves = {channel: np.zeros(frames) for channel in CHANNELS}
    curves["height"] += MEAN.standing_height - 0.02
    for side, sign in (("left", 1.0), ("right", -1.0)):
        curves[f"{side}_foot_x"] += 0.1 * sign
    for channel, values in channels.items():
        curves[channel] = curves[channel] + values
    rotations, translation = solve(curves, MEAN)
    return forward_kinematics(torch.from_numpy(rotations), torch.from_numpy(translation), MEAN.skeleton())[1]


def test_feet_stand_where_the_plan_puts_them() -> None:
    generator = np.random.default_rng(0)
    moves = {
        "height": generator.uniform(-0.4, 0.0, 50),
        "pelvis_pitch": generator.uniform(-20, 40, 50),
        "pelvis_twist": generator.uniform(-30, 30, 50),
        "x": generator.uniform(-0.1, 0.1, 50),
    }
    joints = pose(50, **moves)
    np.testing.assert_allclose(joints[:, JOINT["left_ankle"]], [[0.1, MEAN.midfoot, MEAN.ankle_height]] * 50, atol=1e-6)
    ball = [0.1, MEAN.midfoot - MEAN.ball[0], MEAN.ankle_height + MEAN.ball[1]]
    np.testing.assert_allclose(joints[:, JOINT["left_foot"]], [ball] * 50, atol=1e-6)


def test_a_rolling_foot_turns_about_its_ball() -> None:
    joints = pose(30, left_foot_pitch=np.linspace(-10, -50, 30), height=-0.1)
    ball = joints[:, JOINT["left_foot"]]
    np.testing.assert_allclose(ball, ball[:1].expand_as(ball), atol=1e-6)
    assert (joints[:, JOINT["left_ankle"], 2].diff() > 0).all()


def test_a_pelvis_out_of_reach_lifts_the_heel_and_then_sinks() -> None:
    joints = pose(40, y=np.full(40, -0.45))
    ball = joints[:, JOINT["right_foot"]]
    np.testing.assert_allclose(ball, ball[:1].expand_as(ball), atol=1e-5)
    assert joints[20, JOINT["right_ankle"], 2] > MEAN.ankle_height + 0.04
    assert joints[20, 0, 2] < MEAN.standing_height - 0.02


def test_arms_are_mirror_images() -> None:
    angles = {"flex": 40.0, "abduct": 25.0, "rotate": 30.0, "elbow": 70.0, "wrist": 10.0, "shrug": 5.0, "reach": 8.0}
    joints = pose(1, **{f"{side}_{name}": value for side in ("left", "right") for name, value in angles.items()})[0]
    for part in ("collar", "shoulder", "elbow", "wrist"):
        mirrored = joints[JOINT[f"right_{part}"]] * torch.tensor([-1.0, 1.0, 1.0])
        np.testing.assert_allclose(joints[JOINT[f"left_{part}"]], mirrored, atol=1e-9)


def test_a_bent_elbow_points_forward_and_up() -> None:
    joints = pose(1, left_elbow=90.0)[0]
    forearm = joints[JOINT["left_wrist"]] - joints[JOINT["left_elbow"]]
    assert forearm[1] < -0.2
    assert abs(forearm[2]) < 0.01
