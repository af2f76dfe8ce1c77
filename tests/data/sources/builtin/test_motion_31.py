"""That the actions beyond the first 13 are what their names say."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice, pairwise

import pytest
import torch
from torch import Tensor

from motiongen.data.sources.builtin.actions.pacing import RISE
from motiongen.data.sources.builtin.babel_mag import COUNTS, PART_COUNTS, ROOT_TAGS, STAIRS
from motiongen.data.sources.builtin.body import MEAN
from motiongen.data.sources.builtin.source import BuiltinSource
from motiongen.motion.canonical import heading
from motiongen.motion.representation import ROTATION
from motiongen.motion.skeleton import JOINT, JOINTS
from tests.data.sources.builtin.takes import Take

STILL = 0.01
"""Metres a frame below which a foot stands."""
ANKLES = [JOINT["left_ankle"], JOINT["right_ankle"]]
BALLS = [JOINT["left_foot"], JOINT["right_foot"]]
TRUNK = [JOINT[name] for name in ("head", "neck", "spine1", "spine2", "spine3", "pelvis")]
SHOULDERS = [JOINT["left_shoulder"], JOINT["right_shoulder"]]
WRISTS = [JOINT["left_wrist"], JOINT["right_wrist"]]


def parts(takes: tuple[Take, ...], *tags: str) -> Iterator[tuple[Take, slice]]:
    """The performances whose first tag is one of these."""
    for take in takes:
        for segment in take.sequence.segments:
            if segment.tags[0] in tags:
                yield take, slice(segment.start, segment.stop)


def axes(take: Take, part: slice) -> tuple[Tensor, Tensor]:
    """Directions (2,) ahead and to the left of a person when an action begins."""
    angle = heading(take.sequence.features[part.start]).double()
    return torch.stack([angle.sin(), -angle.cos()]), torch.stack([angle.cos(), angle.sin()])


def moved(take: Take, part: slice) -> Tensor:
    """Pelvis (2,) from the first to the last frame."""
    return take.joints[part.stop - 1, 0, :2] - take.joints[part.start, 0, :2]


def test_all_31_tags_occur(takes_31: tuple[Take, ...]) -> None:
    found = {tag for take in takes_31 for segment in take.sequence.segments for tag in segment.tags}
    assert found == set(COUNTS | PART_COUNTS)
    assert BuiltinSource(repertoire="babel_mag").root_tags == ROOT_TAGS
    assert set(COUNTS) > ROOT_TAGS


def test_segments_touch_and_last_as_long_as_people_take(takes_31: tuple[Take, ...]) -> None:
    for take in takes_31:
        segments = take.sequence.segments
        assert all(before.stop == after.start for before, after in pairwise(segments))
        assert segments[-1].stop == len(take.sequence.features)
        assert all(20 <= segment.stop - segment.start <= 180 for segment in segments)


def test_same_seed_gives_the_same_bits_however_many_sessions_follow(takes_31: tuple[Take, ...]) -> None:
    again = BuiltinSource(sessions=300, repertoire="babel_mag", body_spread=0.08).sequences()
    for take, sequence in zip(takes_31, islice(again, 4), strict=False):
        assert torch.equal(take.sequence.features, sequence.features)
        assert take.sequence.segments == sequence.segments


def test_rotations_are_rotations(takes_31: tuple[Take, ...]) -> None:
    """So that bones keep their lengths: unpacking would bend what is none."""
    for take in takes_31:
        columns = take.sequence.features[:, ROTATION].double().unflatten(1, (JOINTS, 2, 3))
        unit = torch.eye(2, dtype=torch.float64).expand(*columns.shape[:2], 2, 2)
        torch.testing.assert_close(columns @ columns.mT, unit, atol=1e-5, rtol=0)


def test_stairs_go_up_and_back_to_the_floor(takes_31: tuple[Take, ...]) -> None:
    pairs = 0
    for take in takes_31:
        stairs = [(part.start, part.stop) for part in take.sequence.segments if part.tags == (STAIRS,)]
        for (start, top), (again, stop) in zip(stairs[::2], stairs[1::2], strict=True):
            pairs += 1
            assert top == again
            height = take.joints[[start, top, stop - 1], 0, 2]
            rise = float(height[1] - height[0])
            assert 3 * RISE[0] - 0.03 < rise < 5 * RISE[1] + 0.03
            assert abs(height[2] - height[0]) < 0.03
            for ball in BALLS:
                climbed = take.joints[top, ball, 2] - (MEAN.ankle_height + MEAN.ball[1])
                assert abs(climbed - rise) < 0.03
    assert pairs >= 3


def test_a_foot_stands_while_the_other_is_on_its_way(takes_31: tuple[Take, ...]) -> None:
    for take, part in parts(takes_31, STAIRS, "walk backward", "walk sideway"):
        speed = take.joints[part][:, BALLS].diff(dim=0).norm(dim=-1)
        assert speed.amin(dim=1).max() < STILL


def test_walking_backward_and_sideways_goes_there(takes_31: tuple[Take, ...]) -> None:
    for take, part in parts(takes_31, "walk backward"):
        ahead, left = axes(take, part)
        assert moved(take, part) @ ahead < -0.7
        assert (moved(take, part) @ left).abs() < 0.2
    for take, part in parts(takes_31, "walk sideway"):
        ahead, left = axes(take, part)
        assert (moved(take, part) @ left).abs() > 0.35
        assert (moved(take, part) @ ahead).abs() < 0.2
        apart = (take.joints[part, JOINT["left_ankle"]] - take.joints[part, JOINT["right_ankle"]])[:, :2] @ left
        assert apart.min() > 0.05


@pytest.mark.parametrize(
    "tag",
    ["using object", "take something up", "place something down", "move something", "touch something", "stretch",
     "crossing limbs", "touch body part", "bend", "stand"],
)  # fmt: skip
def test_the_body_stays_over_its_feet(takes_31: tuple[Take, ...], tag: str) -> None:
    core = [JOINT[name] for name in ("pelvis", "spine2", "spine3", "head", "left_knee", "right_knee")]
    for take, part in parts(takes_31, tag):
        part = slice(part.start + 25, part.stop)  # some first step together
        feet = take.joints[part][
            :, [JOINT[f"{side}_{name}"] for side in ("left", "right") for name in ("ankle", "foot")]
        ]
        off = take.joints[part][:, core, :2].mean(dim=1) - feet[..., :2].mean(dim=1)
        # 0.22 m of a person of average length; the shortest person's metres come out 1 / 0.92 as long.
        assert off.norm(dim=-1).max() < 0.22 / 0.92


def test_things_are_reached_for_early_and_put_down_late(takes_31: tuple[Take, ...]) -> None:
    """When the hands are furthest from the feet, as a share of the action."""
    when: dict[str, list[float]] = {"take something up": [], "place something down": []}
    for tag, shares in when.items():
        for take, part in parts(takes_31, tag):
            ahead, _ = axes(take, part)
            feet = take.joints[part][:, ANKLES].mean(dim=1)
            reach = ((take.joints[part][:, WRISTS] - feet[:, None])[..., :2] @ ahead).amax(dim=1)
            shares.append(int(reach.argmax()) / len(reach))
    assert max(when["take something up"]) < 0.6
    assert min(when["place something down"]) > 0.5


def test_crossed_wrists_change_sides(takes_31: tuple[Take, ...]) -> None:
    for take, part in parts(takes_31, "crossing limbs"):
        _, left = axes(take, part)
        middle = (part.start + part.stop) // 2
        apart = (take.joints[middle, WRISTS[0]] - take.joints[middle, WRISTS[1]])[:2] @ left
        assert apart < -0.02


def test_a_hand_rests_on_the_body(takes_31: tuple[Take, ...]) -> None:
    near = [
        JOINT[name]
        for name in ("head", "neck", "spine1", "spine2", "spine3", "pelvis", "left_shoulder", "right_shoulder")
    ]
    for take, part in parts(takes_31, "touch body part", "step and touch body part"):
        gap = (take.joints[part][:, WRISTS, None] - take.joints[part][:, None, near]).norm(dim=-1).amin(dim=2)
        still = take.joints[part][:, WRISTS].diff(dim=0).norm(dim=-1)
        # The wrists hang beside the hips at rest: what counts is that one comes up to the trunk and stays.
        raised = take.joints[part][:, WRISTS, 2] - take.joints[part][:, :1, 2] > 0.0
        held = (gap[1:] < 0.27) & raised[1:] & (still < 0.04)
        assert held.sum(dim=0).max() >= 12


def test_bent_people_come_up_again(takes_31: tuple[Take, ...]) -> None:
    for take, part in parts(takes_31, "bend"):
        neck = take.joints[part, JOINT["neck"], 2]
        assert neck.min() < neck[0] - 0.2
        assert neck[-1] > neck[0] - 0.08


def test_work_on_a_chair_is_done_on_a_chair(takes_31: tuple[Take, ...]) -> None:
    for take, part in parts(takes_31, "using object and sit", "sit"):
        assert take.joints[part, 0, 2].max() < 0.53


def test_a_movement_moves_its_part_more_than_a_state_alone(takes_31: tuple[Take, ...]) -> None:
    watched = {
        "head movement": ("head",), "arm movement": ("left_elbow", "right_elbow", "left_shoulder", "right_shoulder"),
        "waist movement": ("spine2",), "leg movement": ("left_knee", "right_knee"),
    }  # fmt: skip

    def travel(take: Take, part: slice, names: tuple[str, ...]) -> float:
        """Degrees that the joints turn by from the action's first frame, at most."""
        local = take.local[part][:, [JOINT[name] for name in names]]
        turned = ((local[:1].mT @ local).diagonal(dim1=-1, dim2=-2).sum(-1) - 1) / 2
        return float(torch.rad2deg(torch.arccos(turned.clamp(-1, 1))).max())

    for tag, names in watched.items():
        moving, quiet = [], []
        for take in takes_31:
            for segment in take.sequence.segments:
                if segment.tags[0] in ("stand", "sit"):
                    side = moving if tag in segment.tags else quiet
                    if tag in segment.tags or len(segment.tags) == 1:
                        side.append(travel(take, slice(segment.start, segment.stop), names))
        assert min(moving) > 4
        assert sorted(moving)[len(moving) // 2] > 2 * sorted(quiet)[len(quiet) // 2], tag
