from __future__ import annotations

import numpy as np
import pytest

from motiongen.data.sources.builtin.actor import Actor
from motiongen.data.sources.builtin.reach import LANDMARKS, PALM, Pose, before, hand, landmark, planned
from motiongen.data.sources.builtin.subjects import cast
from motiongen.motion.skeleton import JOINT


@pytest.fixture
def actor() -> Actor:
    return Actor(cast(0, 1)[0], np.random.default_rng(0))


def palm(pose: Pose, side: str) -> np.ndarray:
    """Along the forearm from the wrist."""
    elbow, wrist = pose.joints[JOINT[f"{side}_elbow"]], pose.joints[JOINT[f"{side}_wrist"]]
    return wrist + PALM * (wrist - elbow) / np.linalg.norm(wrist - elbow)


@pytest.mark.parametrize("role", ["strong", "weak"])
@pytest.mark.parametrize(
    "place", [(0.1, 1.1, 0.4), (-0.1, 1.05, 0.3), (0.4, 1.4, 0.2), (0.15, 0.95, 0.35), (0.1, 1.8, 0.1)]
)
def test_the_palm_is_where_it_was_sent(actor: Actor, role: str, place: tuple[float, float, float]) -> None:
    actor.pose(1.0, {"spine_pitch": 18.0, "spine_twist": 10.0, "pelvis_pitch": 6.0, "spine_roll": -5.0})
    target = before(actor, role, *place)
    hand(actor, 1.0, role, target)
    side = actor.strong if role == "strong" else actor.weak
    np.testing.assert_allclose(palm(planned(actor), side), target, atol=0.005)


def test_hands_meet_places_on_the_body(actor: Actor) -> None:
    for name in LANDMARKS:
        target = landmark(actor, "strong", name)
        hand(actor, 1.0, "strong", target)
        assert np.linalg.norm(palm(planned(actor), actor.strong) - target) < 0.03, name


def test_a_place_out_of_reach_is_pointed_at(actor: Actor) -> None:
    target = before(actor, "strong", 0.2, 1.3, 3.0)
    hand(actor, 1.0, "strong", target)
    pose = planned(actor)
    shoulder = pose.joints[JOINT[f"{actor.strong}_shoulder"]]
    arm, line = palm(pose, actor.strong) - shoulder, target - shoulder
    assert arm @ line / np.linalg.norm(arm) / np.linalg.norm(line) > 0.999


def test_left_and_right_hands_are_mirror_images() -> None:
    people = cast(0, 4)
    assert people[0].right_handed
    arms = []
    for role in ("strong", "weak"):
        actor = Actor(people[0], np.random.default_rng(0))
        hand(actor, 1.0, role, before(actor, role, 0.1, 1.2, 0.4))
        side = actor.strong if role == "strong" else actor.weak
        arms.append([actor.score.last(f"{side}_{name}") for name in ("flex", "abduct", "rotate", "elbow")])
    np.testing.assert_allclose(arms[0], arms[1], atol=0.5)
