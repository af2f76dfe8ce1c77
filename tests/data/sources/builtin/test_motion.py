"""What an animator would check: feet, joints, seams, and that each action does what its name says."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from motiongen.data.sources.builtin.body import MEAN
from motiongen.data.sources.builtin.subjects import cast
from motiongen.motion.canonical import heading
from motiongen.motion.skeleton import FEET, JOINT
from tests.data.sources.builtin.takes import Take

ANKLES, BALLS = (JOINT["left_ankle"], JOINT["right_ankle"]), (JOINT["left_foot"], JOINT["right_foot"])
BALL_HEIGHT = MEAN.ankle_height + MEAN.ball[1]


def standing(take: Take) -> Tensor:
    """(T, 4) whether an ankle or ball is as low as in a flat foot, within 3 mm; order of FEET."""
    heights = take.joints[:, FEET, 2]
    return heights < torch.tensor([MEAN.ankle_height, BALL_HEIGHT] * 2) + 0.003


def test_feet_in_contact_stay(all_takes: tuple[Take, ...]) -> None:
    speeds = []
    for take in all_takes:
        touching = standing(take)
        moved = take.joints[1:, FEET].sub(take.joints[:-1, FEET]).norm(dim=-1)
        speeds.append(moved[touching[1:] & touching[:-1]])
    speed = torch.cat(speeds)
    assert speed.max() < 0.01


def test_feet_stay_above_the_floor(all_takes: tuple[Take, ...]) -> None:
    points = torch.tensor([[0.0, up, forward] for forward, up in (MEAN.heel, MEAN.toe_tip, MEAN.ball)])
    for take in all_takes:
        for ankle in ANKLES:
            sole = take.joints[:, ankle, None] + torch.einsum("tij,nj->tni", take.world[:, ankle], points.double())
            # The tip hangs on the toe joint, which bends; only heel and ball are rigid with the ankle.
            assert sole[:, (0, 2), 2].min() > -0.01
        for ball in BALLS:
            tip = torch.tensor([0.0, *(MEAN.toe_tip - MEAN.ball)[::-1]]).double()
            assert (take.joints[:, ball] + take.world[:, ball] @ tip)[:, 2].min() > -0.012


def test_knees_and_elbows_are_hinges_within_their_limits(all_takes: tuple[Take, ...]) -> None:
    for take in all_takes:
        for side, inward in (("left", -1.0), ("right", 1.0)):
            knee, elbow = take.local[:, JOINT[f"{side}_knee"]], take.local[:, JOINT[f"{side}_elbow"]]
            flexion = torch.rad2deg(torch.atan2(knee[:, 2, 1], knee[:, 1, 1]))
            bend = torch.rad2deg(inward * torch.atan2(elbow[:, 0, 2], elbow[:, 0, 0]))
            assert flexion.min() > -6
            assert flexion.max() < 145
            assert bend.min() >= 0
            assert bend.max() <= 146
            assert (knee[:, :, 0] - torch.tensor([1.0, 0, 0])).abs().max() < 1e-5
            assert (elbow[:, :, 1] - torch.tensor([0, 1.0, 0])).abs().max() < 1e-5


def test_joints_turn_no_faster_than_people(steps: tuple[Tensor, ...]) -> None:
    fastest = torch.stack([step.amax(dim=0) for step in steps]).amax(dim=0)
    assert fastest.max() < 30
    assert fastest[[JOINT[name] for name in ("pelvis", "spine1", "spine2", "spine3", "neck", "head")]].max() < 12


def test_seams_are_as_smooth_as_the_rest(all_takes: tuple[Take, ...]) -> None:
    at_seams, elsewhere = [], []
    for take in all_takes:
        acceleration = take.joints.diff(n=2, dim=0).norm(dim=-1).amax(dim=-1)
        seam = torch.zeros(len(acceleration), dtype=torch.bool)
        for part in take.sequence.segments:
            seam[max(part.start - 3, 0) : part.start + 2] = True
        at_seams.append(acceleration[seam])
        elsewhere.append(acceleration[~seam])
    seams, rest = torch.cat(at_seams), torch.cat(elsewhere)
    assert seams.quantile(0.99) < rest.quantile(0.99)
    assert seams.max() < rest.max()


def test_sitting_is_at_the_height_of_a_chair(all_takes: tuple[Take, ...]) -> None:
    for take in all_takes:
        for part in take.of("sit"):
            height = take.joints[part, 0, 2]
            assert height.min() > 0.43
            assert height.max() < 0.53
        for part in (*take.of("sit down"), *take.of("stand up")):
            feet = take.joints[part][-15:, FEET]
            assert (feet - feet[:1]).norm(dim=-1).max() < 0.02


def test_turns_turn_on_the_spot(all_takes: tuple[Take, ...]) -> None:
    angles = []
    for take in all_takes:
        for part in take.of("turn"):
            yaw = np.unwrap(heading(take.sequence.features[part]).numpy())
            angles.append(np.rad2deg(yaw[-1] - yaw[0]))
            assert (take.joints[part, 0, :2] - take.joints[part][0, 0, :2]).norm(dim=-1).max() < 0.35
    size = np.abs(angles)
    assert size.min() > 50
    assert size.max() < 190
    assert 0.25 < np.mean(np.array(angles) > 0) < 0.75


def test_a_jump_flies_and_falls_with_gravity(all_takes: tuple[Take, ...]) -> None:
    for take in all_takes:
        for part in take.of("jump"):
            up = take.joints[part, 0, 2]
            lowest = take.joints[part][:, FEET, 2] - torch.tensor([MEAN.ankle_height, BALL_HEIGHT] * 2)
            flight = (lowest.amin(dim=-1) > 0.02).nonzero().flatten()
            assert len(flight) >= 5
            middle = flight[2:-2]
            fall = up.diff(n=2)[middle - 1] * 900
            assert abs(fall.mean() + 9.81) < 2.0


def test_running_flies_and_walking_does_not(takes: tuple[Take, ...]) -> None:
    for tag, flies in (("run", True), ("walk", False)):
        airborne, speeds = [], []
        for take in takes:
            for part in take.of(tag):
                part = slice(part.start + 25, part.stop - 25)
                airborne.append((~standing(take)[part].any(dim=-1)).double())
                speeds.append(take.joints[part, 0, :2].diff(dim=0).norm(dim=-1) * 30)
        share, speed = float(torch.cat(airborne).mean()), float(torch.cat(speeds).median())
        assert (share > 0.12) == flies
        assert share < 0.5
        assert (1.9 < speed < 3.2) if flies else (0.9 < speed < 1.7)


def test_the_strong_hand_waves(takes: tuple[Take, ...]) -> None:
    people = cast(0, 12)
    for index, take in enumerate(takes):
        strong = "right" if people[index % 12].right_handed else "left"
        other = "left" if strong == "right" else "right"
        for part in take.of("wave hand"):
            up = take.joints[part][:, :, 2].amax(dim=0)
            assert up[JOINT[f"{strong}_wrist"]] > up[JOINT[f"{other}_wrist"]] + 0.2


def test_people_keep_their_own_posture(takes: tuple[Take, ...]) -> None:
    """How far the neck stands before the pelvis differs between people much more than between one person's takes."""
    means: dict[int, list[float]] = {}
    for index, take in enumerate(takes):
        for part in take.of("stand"):
            ahead = (take.joints[part, JOINT["neck"]] - take.joints[part, 0])[:, :2].norm(dim=-1)
            means.setdefault(index % 12, []).append(float(ahead.mean()))
    within = np.mean([np.std(values) for values in means.values() if len(values) > 2])
    assert np.std([np.mean(values) for values in means.values()]) > 2 * within
