"""The counts of the supplement, the table of transitions, and what is drawn from both."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from motiongen.data.sources.builtin.babel_mag import (
    COUNTS,
    EDGE,
    FOLLOWING,
    LEAST,
    LENGTHS,
    NODES,
    PART_COUNTS,
    PARTS,
    STAIRS,
    Draw,
    may_follow,
    shares,
    transitions,
)  # fmt: skip

SESSIONS = 612
"""As many as make BABEL-MAG's 7643 actions."""


@pytest.fixture(scope="module")
def sessions() -> list[list[tuple[str, ...]]]:
    draw = Draw()
    return [draw(np.random.default_rng([5, index])) for index in range(SESSIONS)]


def test_counts_are_those_of_the_supplement() -> None:
    assert len(COUNTS) + len(PART_COUNTS) == 31
    assert sum(COUNTS.values()) == 7643
    assert sum(PART_COUNTS.values()) == 1281


def test_the_table_names_actions_and_every_action_can_be_reached() -> None:
    assert set(FOLLOWING) == set(NODES)
    for before, listed in FOLLOWING.items():
        names = listed.split(", ")
        assert set(names) <= set(COUNTS), before
        assert len(names) == len(set(names)), before
    reached, fresh = {EDGE}, {EDGE}
    while fresh:
        fresh = {tag for before in fresh for tag in COUNTS if may_follow(before, tag)} - reached
        reached |= fresh
    assert reached == set(NODES)


def test_likelihoods_are_zero_where_the_table_has_no_arrow() -> None:
    table = transitions()
    np.testing.assert_allclose(table.sum(axis=1), 1.0)
    for row, before in enumerate(NODES):
        for column, after in enumerate(NODES[1:], start=1):
            assert (table[row, column] > 0) == may_follow(before, after), (before, after)


def test_only_what_the_table_lists_follows(sessions: list[list[tuple[str, ...]]]) -> None:
    for session in sessions:
        stairs = 0
        assert may_follow(EDGE, session[0][0])
        for (before, *_), (after, *_) in pairwise(session):
            stairs = stairs + 1 if before == STAIRS else 0
            if stairs % 2:
                assert after == STAIRS
            else:
                assert may_follow(before, after), (before, after)


def test_a_chair_is_left_by_standing_up_and_reached_by_sitting_down(sessions: list[list[tuple[str, ...]]]) -> None:
    seated = {"sit", "using object and sit", "stand up"}
    for session in sessions:
        tags = [tag for tag, *_ in session]
        for before, after in pairwise(tags):
            on_chair = before in {"sit down", "sit", "using object and sit"}
            assert (after in seated) == on_chair


def test_sessions_have_5_to_20_actions_of_all_lengths(sessions: list[list[tuple[str, ...]]]) -> None:
    lengths = [len(session) for session in sessions]
    assert min(lengths) == min(LENGTHS)
    assert max(lengths) <= 20
    assert set(lengths) >= set(LENGTHS)


def test_every_tag_is_as_common_as_in_the_supplement(sessions: list[list[tuple[str, ...]]]) -> None:
    """Within four standard deviations of independent draws; rarer tags are raised to 1%."""
    counted = Counter(tag for session in sessions for tags in session for tag in tags)
    total = sum(map(len, sessions))
    assert set(counted) == set(COUNTS | PART_COUNTS)
    print(table_of_counts(counted, total))
    for tag, share in shares().items():
        assert abs(counted[tag] - share * total) < 4 * np.sqrt(share * total), tag
    common = [tag for tag, count in COUNTS.items() if count >= LEAST]
    ratio = np.array([counted[tag] / COUNTS[tag] for tag in common])
    np.testing.assert_allclose(ratio / ratio.mean(), 1.0, atol=0.35)


def test_an_hour_has_clips_of_every_tag_whatever_the_seed() -> None:
    for seed in range(6):
        draw = Draw()
        counted = Counter(
            tag for index in range(120) for tags in draw(np.random.default_rng([seed, index])) for tag in tags
        )
        assert min(counted[tag] for tag in shares()) >= 8, seed


def test_parts_of_the_body_move_in_states_alone(sessions: list[list[tuple[str, ...]]]) -> None:
    several = {tags for session in sessions for tags in session if len(tags) > 1}
    assert len(several) > 15
    for tag, *parts in several:
        assert set(parts) <= set(PARTS[tag])


def table_of_counts(counted: Counter[str], total: int) -> str:
    """What `pytest -s` prints: segments in the supplement, in these sessions, and shares of all actions in percent."""
    rows = [
        f"{tag:26} {count:5} {counted[tag]:5} {count / 76.43:6.2f} {100 * counted[tag] / total:6.2f}"
        for tag, count in (COUNTS | PART_COUNTS).items()
    ]
    return "\n".join([f"{'':26} {'paper':>5} {'drawn':>5} {'paper%':>6} {'drawn%':>6}", *rows])
