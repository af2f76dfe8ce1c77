from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import torch

from motiongen.data.dataset import MotionDataset, bucketed, collate, random_window
from motiongen.data.splits import Clip
from motiongen.data.store import ClipStore
from motiongen.motion.canonical import GroundFrame, heading
from motiongen.motion.representation import TRANSLATION
from tests.data.corpus import ListedSource, session

SEGMENTS = [(0, 30, "walk"), (30, 90, "wave,stand"), (90, 120, "turn"), (118, 150, "walk")]
TAGS = ("stand", "walk", "wave")
WALK, WAVE = Clip(0, 0, 6, 30, 0), Clip(0, 1, 30, 90, 24)


@pytest.fixture
def store(tmp_path: Path) -> ClipStore:
    return ClipStore.open(ListedSource([session("one", SEGMENTS, 150)], frozenset({"walk"})), tmp_path)


def test_an_item_is_in_the_frame_of_its_last_initial_pose(store: ClipStore) -> None:
    item = MotionDataset(store, TAGS, [WAVE])[0]
    last = item.initial_motion[-1]
    assert heading(last).abs() < 1e-5
    assert last[TRANSLATION][:2].abs().max() < 1e-6
    world = store.features(0)
    assert torch.equal(last[TRANSLATION][2], world[29, TRANSLATION][2]), "the height is kept"
    back = GroundFrame.of(world[29]).leave(torch.cat([item.initial_motion, item.motion]))
    assert torch.allclose(back, world[24:90], atol=1e-5)


def test_tags_and_what_follows(store: ClipStore) -> None:
    turn, last = Clip(0, 2, 90, 120, 84), Clip(0, 3, 118, 150, 112)
    items = [MotionDataset(store, TAGS, [WALK, WAVE, turn, last])[index] for index in range(4)]
    assert [item.tags.tolist() for item in items] == [[0, 1, 0], [1, 0, 1], [0, 0, 0], [0, 1, 0]]
    # "turn" is no tag of the split; the last segment starts before "turn" stops, so that nothing follows "turn".
    assert [item.next_tags.tolist() for item in items] == [[1, 0, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0]]


def test_a_window_that_ends_early_is_followed_by_its_own_action(store: ClipStore) -> None:
    first, last = (MotionDataset(store, TAGS, WAVE.windows(40, 10))[index] for index in range(2))
    assert first.next_tags.tolist() == [1, 0, 1]
    assert last.next_tags.tolist() == [0, 0, 0]


def test_styles_are_those_of_the_segment_and_zero_where_there_are_none(tmp_path: Path) -> None:
    styled = session("styled", [(0, 40, "walk@sad,old"), (40, 80, "wave"), (80, 120, "wave@angry")], 120)
    store = ClipStore.open(ListedSource([styled]), tmp_path)
    assert store.styles == ("angry", "old", "sad")
    clips = [Clip(0, 0, 6, 40, 0), Clip(0, 1, 40, 80, 34), Clip(0, 2, 80, 120, 74)]
    items = [MotionDataset(store, TAGS, clips)[index] for index in range(3)]
    assert [item.styles.tolist() for item in items] == [[0, 1, 1], [0, 0, 0], [1, 0, 0]]
    assert collate(items).condition.styles.shape == (3, 3)


def test_data_without_styles_has_style_vectors_without_columns(store: ClipStore) -> None:
    assert store.styles == ()
    assert collate([MotionDataset(store, TAGS, [WALK])[0]]).condition.styles.shape == (1, 0)


def test_hidden_segments_come_without_labels(store: ClipStore) -> None:
    shown, hidden = (
        MotionDataset(store, TAGS, WAVE.windows(40, 10), hidden=frozenset({key}))[0] for key in [(0, 0), (0, 1)]
    )
    assert shown.tags.tolist() == shown.next_tags.tolist() == [1, 0, 1]
    assert hidden.tags.tolist() == hidden.next_tags.tolist() == [0, 0, 0]
    assert torch.equal(shown.motion, hidden.motion)


def test_only_actions_that_travel_have_a_trajectory(store: ClipStore) -> None:
    walk, wave = (MotionDataset(store, TAGS, [WALK, WAVE])[index] for index in range(2))
    assert torch.equal(walk.trajectory, walk.motion[:, TRANSLATION][:, :2])
    assert walk.trajectory.abs().max() > 0
    assert wave.trajectory.shape == (60, 2)
    assert not wave.trajectory.any()


def test_a_batch_is_padded_with_zeros_and_masked(store: ClipStore) -> None:
    items = [MotionDataset(store, TAGS, [WALK, WAVE])[index] for index in range(2)]
    batch = collate(items)
    assert batch.motion.shape == (2, 60, 135)
    assert batch.condition.initial_motion.shape == (2, 6, 135)
    assert batch.condition.mask.dtype == torch.bool
    assert batch.condition.lengths.tolist() == [24, 60]
    assert batch.condition.mask[0, :24].all()
    assert torch.equal(batch.motion[0, :24], items[0].motion)
    assert not batch.motion[0, 24:].any()
    assert not batch.condition.trajectory[0, 24:].any()


def test_random_windows_stay_inside_and_reach_both_ends() -> None:
    clip = Clip(0, 0, start=10, stop=50, initial_start=4)
    rng = np.random.default_rng(0)
    windows = [random_window(clip, 35, rng) for _ in range(200)]
    assert {len(window) for window in windows} == {35}
    assert {window.start for window in windows} == set(range(10, 16))
    assert all(window.start - window.initial_start == 6 for window in windows)
    assert random_window(clip, 40, rng) == clip


def test_a_share_of_the_windows_starts_where_the_clip_does() -> None:
    clip, rng = Clip(0, 0, start=10, stop=110, initial_start=4), np.random.default_rng(0)
    windows = [random_window(clip, 35, rng, beginnings=0.4) for _ in range(1000)]
    at_start = sum(window.start == 10 for window in windows)
    assert 360 < at_start < 450, "0.4, and one in 66 of the others"
    assert max(window.stop for window in windows) == 110


def test_windows_of_random_length_cover_all_that_fit() -> None:
    clip = Clip(0, 0, start=10, stop=22, initial_start=4)
    rng = np.random.default_rng(0)
    windows = [random_window(clip, 9, rng, min_frames=7) for _ in range(400)]
    assert {(window.start, len(window)) for window in windows} == {
        (start, length) for length in (7, 8, 9) for start in range(10, 22 - length + 1)
    }
    counts = [sum(len(window) == length for window in windows) for length in (7, 8, 9)]
    assert min(counts) > 100, "lengths are drawn uniformly"
    assert {len(random_window(clip, 99, rng, min_frames=12)) for _ in range(5)} == {12}


def test_batches_hold_everything_once_and_waste_little() -> None:
    rng = np.random.default_rng(0)
    lengths = rng.integers(20, 151, size=1000).tolist()
    batches = bucketed(lengths, 30, rng)
    assert sorted(index for batch in batches for index in batch) == list(range(1000))
    assert len(batches) == math.ceil(1000 / 30)
    assert sorted(map(len, batches))[1] == 30
    padded = sum(max(lengths[index] for index in batch) * len(batch) for batch in batches)
    assert 1 - sum(lengths) / padded < 0.06
    longest = [max(lengths[index] for index in batch) for batch in batches]
    assert longest != sorted(longest), "batches come in random order"
