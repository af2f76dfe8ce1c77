from __future__ import annotations

import itertools
from pathlib import Path

import pytest
import torch

from motiongen.data.clips import Segment, Sequence
from motiongen.data.datamodule import MotionData
from motiongen.errors import InputError
from motiongen.evaluation.sequences import (
    SequenceProtocol,
    draw_sequences,
    plausible_transitions,
    recorded_transitions,
)
from tests.data.corpus import ListedSource, session
from tests.motion.poses import standing


def recorded(cache: Path) -> MotionData:
    """Eight takes of a walk, a stop and a wave, of which only walk -> stop and stop -> wave happen."""
    cut = [(0, 40, "walk"), (40, 80, "stop"), (80, 120, "wave")]
    return MotionData(source=ListedSource([session(f"take_{n}", cut, 120) for n in range(8)]), cache=str(cache))


def test_transitions_are_counted_in_training_only(tmp_path):
    data = recorded(tmp_path)
    counts = recorded_transitions(data)
    trained = len({clip.sequence for clip in data.split.train})
    assert trained < 8
    assert data.tags == ("stop", "walk", "wave")
    assert counts.tolist() == [[0, 0, trained], [trained, 0, 0], [0, 0, 0]]


def test_plausible_transitions_go_by_poses_whatever_the_place_and_heading(tmp_path):
    def clip(name: str, tag: str, first: float, last: float, number: int) -> Sequence:
        """A body whose pelvis goes from one height to another; the heights stand for poses."""
        motion = standing(50)
        motion[:, -1] = torch.linspace(first, last, 50)
        motion[:6, -1], motion[-1, -1] = first, last
        motion[:, -3] = 3.0 * number
        return Sequence(name, name, motion, (Segment(0, 50, (tag,)),))

    rows = [clip(f"sit_{n}", "sit down", 0.9, 0.5, n) for n in range(6)]
    rows += [clip(f"up_{n}", "stand up", 0.5, 0.9, n) for n in range(6)]
    data = MotionData(source=ListedSource(rows), cache=str(tmp_path))
    assert data.tags == ("sit down", "stand up")
    assert recorded_transitions(data).sum() == 0
    assert plausible_transitions(data, 0.05).tolist() == [[0, 1], [1, 0]]
    assert plausible_transitions(data, 0.5).tolist() == [[1, 1], [1, 1]]


TRANSITIONS = torch.tensor([[0.0, 5, 1, 0, 0, 0], [1, 2, 3, 4, 5, 6], *[[0.0] * 6] * 4])
TAGS = torch.eye(6)[torch.arange(18) % 6]
UNKNOWN = torch.zeros(18, 6)


def tags_of(chains: list[list[int]]) -> set[tuple[int, int]]:
    return {(one % 6, other % 6) for chain in chains for one, other in itertools.pairwise(chain)}


def test_overall_takes_whatever_followed_once():
    chains = draw_sequences("overall", TRANSITIONS, TAGS, UNKNOWN, count=300, actions=6, seed=0)
    assert len(chains) == 300
    assert {len(chain) for chain in chains} == {6}
    # Of tags that nothing follows, the tag stays.
    assert tags_of(chains) == {(0, 1), (0, 2), *((1, n) for n in range(6)), (2, 2), (3, 3), (4, 4), (5, 5)}
    firsts = [chain[0] for chain in chains]
    assert sorted(firsts[:18]) == list(range(18))
    assert sorted(firsts[18:36]) == list(range(18))


def test_sufficient_takes_the_likeliest_four_the_tag_itself_and_what_came_next():
    following = UNKNOWN.clone()
    following[0, 5] = 1
    chains = draw_sequences("sufficient", TRANSITIONS, TAGS, following, count=300, actions=6, seed=0)
    seen = tags_of(chains)
    assert {(0, 0), (0, 1), (0, 2), (0, 5)} <= seen
    assert {pair for pair in seen if pair[0] == 1} == {(1, 1), (1, 2), (1, 3), (1, 4), (1, 5)}
    assert {pair for pair in seen if pair[0] > 1} == {(2, 2), (3, 3), (4, 4), (5, 5)}
    # What came next is that of the very clip.
    assert all(
        one % 18 == 0 for chain in chains for one, other in itertools.pairwise(chain) if one % 6 == 0 and other % 6 == 5
    )


def test_the_same_seed_draws_the_same():
    options = {"count": 5, "actions": 4}
    one = draw_sequences("overall", TRANSITIONS, TAGS, UNKNOWN, seed=1, **options)
    assert one == draw_sequences("overall", TRANSITIONS, TAGS, UNKNOWN, seed=1, **options)
    assert one != draw_sequences("overall", TRANSITIONS, TAGS, UNKNOWN, seed=2, **options)


def test_an_unknown_kind_is_told():
    with pytest.raises(InputError, match="there is no kind 'overal'; did you mean 'overall'"):
        SequenceProtocol(kinds=["overal"])
