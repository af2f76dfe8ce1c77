from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from motiongen.data.clips import DataError, Sequence, Side
from motiongen.data.splits import Clip, Split, all_clips, split, validation_split
from motiongen.data.store import ClipStore
from tests.data.corpus import ListedSource, session

TAGS = ("bow", "jump", "kick", "run", "turn", "walk")


def single_action_clips(rng: np.random.Generator) -> list[tuple[str, str, list[str]]]:
    """One action a sequence, some sequences in groups: (name, group, tags of its segments)."""
    rows = []
    for tag in TAGS:
        for take in range(int(rng.integers(6, 40))):
            rows.append((f"{tag}_{take}", f"{tag}_{take // int(rng.integers(1, 4))}", [tag]))
    return rows


def long_sessions(rng: np.random.Generator) -> list[tuple[str, str, list[str]]]:
    """Many actions a sequence, frequent and rare ones, some with two tags."""
    rows = []
    for number in range(40):
        tags = [str(tag) for tag in rng.choice(TAGS, size=8, p=(0.02, 0.08, 0.1, 0.2, 0.2, 0.4))]
        tags[0] = f"{tags[0]},stand" if tags[0] != "walk" else "walk"
        rows.append((f"session_{number}", f"session_{number}", tags))
    return rows


def store_of(rows: list[tuple[str, str, list[str]]], cache: Path) -> ClipStore:
    def sequence(name: str, group: str, tags: list[str]) -> Sequence:
        return session(name, [(30 * i, 30 * i + 30, tag) for i, tag in enumerate(tags)], 30 * len(tags), group)

    return ClipStore.open(ListedSource([sequence(*row) for row in rows]), cache)


def tags_of(store: ClipStore, clip: Clip) -> tuple[str, ...]:
    return store.sequences[clip.sequence].segments[clip.segment].tags


def counts(store: ClipStore, clips: tuple[Clip, ...]) -> Counter[str]:
    return Counter(tag for clip in clips for tag in tags_of(store, clip))


@pytest.mark.parametrize("corpus", [single_action_clips, long_sessions])
@pytest.mark.parametrize("seed", range(6))
def test_promises_of_every_split(tmp_path: Path, corpus: object, seed: int) -> None:
    assert callable(corpus)
    store = store_of(corpus(np.random.default_rng(seed)), tmp_path)
    result = split(store, seed, test_cap=9)
    groups = [{store.sequences[clip.sequence].group for clip in side} for side in (result.train, result.test)]
    assert not groups[0] & groups[1]
    train, test = counts(store, result.train), counts(store, result.test)
    assert set(result.tags) | set(result.left_out) == set(store.tags)
    assert not set(result.tags) & set(result.left_out)
    for tag in result.tags:
        assert train[tag] >= 1
        assert 1 <= test[tag] <= 9
        assert train[tag] + test[tag] >= 5
    # Nothing is used twice, and nothing is lost but what a tag has beyond the cap.
    clips = [*result.train, *result.test]
    assert len(set(clips)) == len(clips)
    for clip in set(all_clips(store, 20)) - set(clips):
        assert not set(tags_of(store, clip)) & set(result.tags) or any(test[tag] == 9 for tag in tags_of(store, clip))
        assert store.sequences[clip.sequence].group not in groups[0]
    assert split(store, seed, test_cap=9) == result


def test_rare_tags_are_tested_on_their_share_where_frequent_ones_are_capped(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    rows = [(f"s{number}", f"s{number}", ["walk"] * 9 + [str(rng.choice(("bow", "kick")))]) for number in range(60)]
    store = store_of(rows, tmp_path)
    result = split(store, 0, test_cap=10)
    train, test = counts(store, result.train), counts(store, result.test)
    for tag in ("bow", "kick"):
        assert test[tag] == min(10, round(0.2 * (train[tag] + test[tag])))
    assert test["walk"] == 10
    # The rest of the tested sessions is on neither side.
    assert train["walk"] == 9 * sum(train[tag] for tag in ("bow", "kick"))


@pytest.mark.parametrize("seed", range(4))
def test_no_clip_changes_sides_with_the_shortest_length(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    sequences = [
        session(f"{tag}_{take}", [(0, frames, tag)], frames)
        for tag in TAGS
        for take, frames in enumerate(rng.integers(8, 120, size=30).tolist())
    ]
    store = ClipStore.open(ListedSource(sequences), tmp_path)
    sides = [split(store, seed, min_frames=shortest) for shortest in (1, 20, 60)]
    for longer, shorter in pairwise(reversed(sides)):
        assert longer.tags == shorter.tags
        for kept, every in ((longer.train, shorter.train), (longer.test, shorter.test)):
            assert set(kept) <= set(every)
        assert len(longer.train) < len(shorter.train)
    assert all(len(clip) >= 60 for clip in (*sides[2].train, *sides[2].test))


def test_a_tag_without_clips_that_are_long_enough_is_left_out(tmp_path: Path) -> None:
    lengths = {"bow": 40, "walk": 80}
    rows = [(f"{tag}_{take}", tag, frames) for tag, frames in lengths.items() for take in range(10)]
    sequences = [session(name, [(0, frames, tag)], frames) for name, tag, frames in rows]
    result = split(ClipStore.open(ListedSource(sequences), tmp_path), 0, min_frames=60)
    assert result.tags == ("walk",)
    assert result.left_out == {"bow": "no clip of 60 frames on one side"}
    assert len(result.train) + len(result.test) == 10


def test_each_tag_gets_a_fifth_where_clips_stand_alone(tmp_path: Path) -> None:
    rows = [(f"{tag}_{i}", f"{tag}_{i}", [tag]) for number, tag in enumerate(TAGS) for i in range(5 + 7 * number)]
    store = store_of(rows, tmp_path)
    test = counts(store, split(store, 0).test)
    assert [test[tag] for tag in TAGS] == [round(0.2 * (5 + 7 * number)) for number in range(len(TAGS))]


def test_sessions_come_close_to_a_fifth(tmp_path: Path) -> None:
    store = store_of(long_sessions(np.random.default_rng(0)), tmp_path)
    result = split(store, 0)
    train, test = counts(store, result.train), counts(store, result.test)
    for tag in ("run", "turn", "walk"):
        assert test[tag] / (train[tag] + test[tag]) == pytest.approx(0.2, abs=0.07)


def test_another_seed_is_another_split(tmp_path: Path) -> None:
    store = store_of(single_action_clips(np.random.default_rng(0)), tmp_path)
    assert split(store, 0).test != split(store, 1).test


def test_tags_that_cannot_be_on_both_sides_are_left_out_and_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    rows = [(f"walk_{i}", f"walk_{i}", ["walk"]) for i in range(10)]
    rows += [(f"bow_{i}", "bow", ["bow"]) for i in range(9)]
    rows += [(f"kick_{i}", f"kick_{i}", ["kick"]) for i in range(4)]
    store = store_of(rows, tmp_path)
    result = split(store, 0)
    assert result.tags == ("walk",)
    assert set(result.left_out) == {"bow", "kick"}
    assert result.left_out["kick"] == "4 clips, fewer than 5"
    assert "bow" in caplog.text
    assert "kick" in caplog.text
    assert set(counts(store, result.train)) | set(counts(store, result.test)) == {"walk"}


def test_a_data_set_that_cannot_be_split_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no tag has clips on both sides"):
        split(store_of([("one", "one", ["walk"] * 9)], tmp_path), 0)


def official(sides: dict[str, Side | None], cache: Path, group: str | None = None) -> ClipStore:
    """A clip of each tag in every sequence, which the data set's own split has on these sides."""
    segments = [(40 * number, 40 * number + 40, tag) for number, tag in enumerate(TAGS)]
    sequences = [replace(session(name, segments, 40 * len(TAGS), group), side=side) for name, side in sides.items()]
    return ClipStore.open(ListedSource(sequences), cache)


@pytest.mark.parametrize("seed", range(3))
def test_a_data_set_s_own_split_is_kept(tmp_path: Path, seed: int) -> None:
    store = official({"one": "test", "two": "train", "three": "test", "four": "test"}, tmp_path)
    result = split(store, seed, test_share=0.1, test_cap=1, min_clips=2)
    assert result.tags == TAGS
    assert {store.sequences[clip.sequence].name for clip in result.train} == {"two"}
    assert {store.sequences[clip.sequence].name for clip in result.test} == {"one", "three", "four"}
    assert len(result.train) + len(result.test) == 4 * len(TAGS)


def test_tags_that_the_data_set_s_own_split_has_on_one_side_are_left_out(tmp_path: Path) -> None:
    sequences = [
        replace(session("one", [(0, 40, "walk"), (40, 80, "bow")], 80), side="train"),
        replace(session("two", [(0, 40, "walk"), (40, 80, "kick")], 80), side="test"),
    ]
    result = split(ClipStore.open(ListedSource(sequences), tmp_path), 0, min_clips=1)
    assert result.tags == ("walk",)
    assert set(result.left_out) == {"bow", "kick"}


@pytest.mark.parametrize(
    ("sides", "group", "message"),
    [
        ({"one": "train", "two": "test"}, "together", "has the group together on both sides"),
        ({"one": "train", "two": "test", "three": None}, None, "leaves out the group three"),
        ({"one": "train", "two": "train"}, None, "has nothing to test"),
        ({"one": "test", "two": "test"}, None, "no tag has clips of 20 frames on both sides"),
    ],
)
def test_a_split_that_leaks_or_is_not_whole_is_refused(
    tmp_path: Path, sides: dict[str, Side | None], group: str | None, message: str
) -> None:
    with pytest.raises(DataError, match=message):
        split(official(sides, tmp_path, group), 0, min_clips=2)


def only_clips(result: Split) -> list[tuple[int, int, int]]:
    clips = sorted([*result.train, *result.test], key=lambda clip: (clip.sequence, clip.segment))
    return [(clip.initial_start, clip.start, clip.stop) for clip in clips]


def test_initial_motion_is_the_frames_before_or_the_sequence_s_own_first_six(tmp_path: Path) -> None:
    segments = [(0, 40, "a"), (40, 80, "a"), (80, 90, "a")]
    late = [(3, 43, "a")]
    source = ListedSource([session("one", segments, 90), session("two", late, 43), session("three", late, 50)])
    result = split(ClipStore.open(source, tmp_path), 0, min_clips=2)
    # The third segment of "one" is too short to be a clip.
    assert only_clips(result) == [(0, 6, 40), (34, 40, 80), (0, 6, 43), (0, 6, 43)]


def test_windows_are_consecutive_and_a_short_rest_is_dropped() -> None:
    clip = Clip(sequence=0, segment=1, start=100, stop=350, initial_start=94)
    parts = clip.windows(max_frames=100, min_frames=20)
    assert [(part.initial_start, part.start, part.stop) for part in parts] == [
        (94, 100, 200),
        (194, 200, 300),
        (294, 300, 350),
    ]
    assert len(clip.windows(max_frames=100, min_frames=51)) == 2
    assert clip.windows(max_frames=250, min_frames=20) == [clip]


def test_validation_takes_groups_of_the_training_side_alone(tmp_path: Path) -> None:
    data = store_of(long_sessions(np.random.default_rng(0)), tmp_path)
    whole = split(data, seed=0)
    inner = validation_split(data, whole, 0, share=0.3, min_frames=20)
    trained = {data.sequences[clip.sequence].group for clip in inner.train}
    validated = {data.sequences[clip.sequence].group for clip in inner.test}
    tested = {data.sequences[clip.sequence].group for clip in whole.test}
    assert not trained & validated
    assert not (trained | validated) & tested
    assert {clip.key for clip in (*inner.train, *inner.test)} <= {clip.key for clip in whole.train}
    assert set(inner.tags) <= set(whole.tags)
