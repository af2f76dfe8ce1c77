from __future__ import annotations

import numpy as np
import torch

from motiongen.data.sources.builtin.actor import Actor
from motiongen.data.sources.builtin.body import MEAN, Body
from motiongen.data.sources.builtin.ik import solve
from motiongen.data.sources.builtin.reach import before, hand
from motiongen.data.sources.builtin.score import CHANNELS
from motiongen.data.sources.builtin.subjects import cast
from motiongen.motion.kinematics import forward_kinematics
from motiongen.motion.skeleton import JOINT

PEOPLE = cast(0, 12, 0.08)


def posed(actor: Actor) -> torch.Tensor:
    """Joints (22, 3) of the pose that the last keys have, on the body that performs."""
    curves = {channel: np.array([actor.score.last(channel)]) for channel in CHANNELS}
    rotations, translation = solve(curves, actor.subject.body)
    skeleton = actor.subject.body.skeleton()
    return forward_kinematics(torch.from_numpy(rotations), torch.from_numpy(translation), skeleton)[1][0]


def test_bones_have_the_proportions_that_were_asked_for() -> None:
    mean, other = MEAN.skeleton().offsets, Body(1.05, trunk=0.95, breadth=1.1, arms=0.9).skeleton().offsets
    share = (other.norm(dim=-1) / mean.norm(dim=-1).clamp(min=1e-9)) / 1.05
    for joint, factor in (("spine2", 0.95), ("left_shoulder", 1.1), ("right_wrist", 0.9), ("left_knee", 1.0)):
        assert abs(share[JOINT[joint]] - factor) < 1e-6
    torch.testing.assert_close(other[JOINT["left_hip"]] * torch.tensor([-1.0, 1, 1]), other[JOINT["right_hip"]])


def test_people_differ_in_body_but_move_as_they_would_without() -> None:
    statures = sorted(person.body.stature for person in PEOPLE)
    assert statures[0] < 0.94
    assert statures[-1] > 1.06
    same = cast(0, 12)
    assert {person.body for person in same} == {MEAN}
    assert [person.tempo for person in same] == [person.tempo for person in PEOPLE]


def test_whoever_stands_has_both_feet_on_the_floor() -> None:
    for person in PEOPLE:
        joints = posed(Actor(person, np.random.default_rng(0)))
        for side in ("left", "right"):
            assert abs(joints[JOINT[f"{side}_ankle"], 2] - person.body.ankle_height) < 0.002


def test_everybodys_hand_comes_to_its_place() -> None:
    for person in PEOPLE:
        actor = Actor(person, np.random.default_rng(0))
        place = before(actor, "strong", 0.15, 1.1, 0.35)
        hand(actor, 0.5, "strong", place)
        wrist = posed(actor)[JOINT[f"{actor.strong}_wrist"]].numpy()
        assert 0.04 < np.linalg.norm(wrist - place) < 0.10
