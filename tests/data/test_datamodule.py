from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import pytest
import torch

from motiongen.contracts import MotionBatch
from motiongen.data.datamodule import MotionData
from motiongen.errors import InputError
from tests.data.corpus import ListedSource, session

ROWS = [
    session(f"{tag}_{take}", [(0, 30 + 10 * take, tag)], 30 + 10 * take)
    for tag in ("walk", "wave")
    for take in range(10)
]


def data(
    cache: Path,
    seed: int = 0,
    split_seed: int = 0,
    max_frames: int = 60,
    draws: int = 1,
    min_frames: int = 20,
    random_length: bool = False,
    hidden_labels: float = 0.0,
    train_frames: int | None = None,
    workers: int = 0,
) -> MotionData:
    return MotionData(
        source=ListedSource(ROWS, frozenset({"walk"})),
        cache=str(cache),
        seed=seed,
        split_seed=split_seed,
        batch_size=4,
        max_frames=max_frames,
        min_frames=min_frames,
        draws=draws,
        random_length=random_length,
        hidden_labels=hidden_labels,
        train_frames=train_frames,
        workers=workers,
    )


def same(one: list[MotionBatch], other: list[MotionBatch]) -> bool:
    return len(one) == len(other) and all(
        a.motion.shape == b.motion.shape
        and torch.equal(a.motion, b.motion)
        and torch.equal(a.condition.initial_motion, b.condition.initial_motion)
        for a, b in zip(one, other, strict=True)
    )


def test_an_epoch_depends_on_seed_and_epoch_only(tmp_path: Path) -> None:
    first, again = data(tmp_path), data(tmp_path)
    epoch = list(first.train_batches(3))
    torch.manual_seed(5)
    list(again.train_batches(0))
    assert same(epoch, list(again.train_batches(3)))
    assert not same(epoch, list(first.train_batches(4)))
    assert not same(epoch, list(data(tmp_path, seed=1).train_batches(3)))


def test_batches_do_not_depend_on_the_processes_that_make_them(tmp_path: Path) -> None:
    assert same(list(data(tmp_path).train_batches(3)), list(data(tmp_path, workers=2).train_batches(3)))


def test_batches_leave_the_global_generator_alone(tmp_path: Path) -> None:
    batches = data(tmp_path)
    before = torch.get_rng_state()
    list(batches.train_batches(0))
    list(batches.test_batches(3))
    assert torch.equal(before, torch.get_rng_state())


def test_every_epoch_shows_every_training_clip_in_windows_that_move(tmp_path: Path) -> None:
    run = data(tmp_path)
    epochs = [list(run.train_batches(epoch)) for epoch in range(8)]
    expected = sorted(min(len(clip), 60) for clip in run.split.train)
    for batches in epochs:
        assert len(run.train_batches(0)) == len(batches)
        assert sorted(torch.cat([batch.condition.lengths for batch in batches]).tolist()) == expected
    first_poses = torch.cat([batch.condition.initial_motion[:, -1] for batches in epochs for batch in batches])
    assert len(first_poses.unique(dim=0)) > 2 * len(run.split.train)


def test_draws_multiply_an_epoch(tmp_path: Path) -> None:
    run = data(tmp_path, draws=3)
    lengths = torch.cat([batch.condition.lengths for batch in run.train_batches(0)])
    assert len(lengths) == 3 * len(run.split.train)


def test_one_length_for_all_where_least_and_most_are_the_same(tmp_path: Path) -> None:
    run = data(tmp_path, max_frames=60, min_frames=60)
    assert {len(clip) >= 60 for clip in (*run.split.train, *run.split.test)} == {True}
    for batches in (run.train_batches(0), run.test_batches(3), run.train_windows(3)):
        assert set(torch.cat([batch.condition.lengths for batch in batches]).tolist()) == {60}


def test_training_windows_of_random_length_leave_the_test_windows_alone(tmp_path: Path) -> None:
    fixed, random = (data(tmp_path, max_frames=80, min_frames=40, random_length=chosen) for chosen in (False, True))
    lengths = torch.cat([batch.condition.lengths for epoch in range(9) for batch in random.train_batches(epoch)])
    assert lengths.min() >= 40
    assert lengths.max() <= 80
    assert len(lengths.unique()) > 20
    assert same(list(random.train_batches(3)), list(random.train_batches(3)))
    assert same(list(random.test_batches(3)), list(fixed.test_batches(3)))
    assert random.fingerprint == fixed.fingerprint


def test_a_training_on_short_windows_is_judged_on_those_of_another(tmp_path: Path) -> None:
    short, other = (
        data(tmp_path, max_frames=80, min_frames=40, train_frames=40),
        data(tmp_path, max_frames=80, min_frames=40),
    )
    assert set(torch.cat([batch.condition.lengths for batch in short.train_batches(0)]).tolist()) == {40}
    assert same(list(short.test_batches(3)), list(other.test_batches(3)))
    assert short.fingerprint == other.fingerprint
    with pytest.raises(InputError, match=r"data\.train_frames \(90\)"):
        data(tmp_path, max_frames=80, min_frames=40, train_frames=90)


def test_test_motions_of_a_length_begin_where_test_windows_do(tmp_path: Path) -> None:
    run = data(tmp_path, max_frames=40)
    items = run.test_items()
    starts = {tuple(items[number].initial_motion.flatten().tolist()) for number in range(len(items))}
    for frames in (25, 60, 95):
        batches = list(run.test_windows(frames, 3))
        assert all(batch.motion.shape[1] == frames and batch.condition.mask.all() for batch in batches)
        fits = sum(part.start + frames <= clip.stop for clip in run.split.test for part in clip.windows(40, 20))
        assert sum(len(batch.motion) for batch in batches) == fits
        begun = {tuple(one.flatten().tolist()) for batch in batches for one in batch.condition.initial_motion}
        assert begun <= starts
    assert list(run.test_windows(500, 3)) == []


def test_test_batches_hold_all_test_windows_and_never_change(tmp_path: Path) -> None:
    run = data(tmp_path)
    batches = list(run.test_batches(3))
    lengths = torch.cat([batch.condition.lengths for batch in batches]).tolist()
    assert lengths == sorted(lengths)
    windows = [part for clip in run.split.test for part in clip.windows(60, 20)]
    assert sorted(lengths) == sorted(map(len, windows))
    assert same(batches, list(run.test_batches(3)))
    assert run.test_items().clips == tuple(windows)
    assert len(run.train_items()) >= len(run.split.train)


def test_the_fingerprint_tells_what_is_trained_and_tested_on(tmp_path: Path) -> None:
    prints = {data(tmp_path / str(index)).fingerprint for index in range(2)}
    assert len(prints) == 1
    others = [data(tmp_path, split_seed=1), data(tmp_path, max_frames=50)]
    assert len(prints | {other.fingerprint for other in others}) == 3
    assert data(tmp_path, seed=1).fingerprint in prints, "another training sees other windows of the same clips"
    assert data(tmp_path, draws=2).fingerprint in prints, "the same windows may be drawn, only more often"


def test_windows_that_cannot_be_cut_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"data\.max_frames \(10\) is below data\.min_frames \(20\)"):
        data(tmp_path, max_frames=10)


def labelled(batches: Iterable[MotionBatch]) -> Counter[tuple[bool, ...]]:
    """How many clips come with each tag vector."""
    return Counter(tuple((row > 0).tolist()) for batch in batches for row in batch.condition.tags)


def test_a_share_of_the_training_clips_hides_its_labels_and_nothing_else_does(tmp_path: Path) -> None:
    run = data(tmp_path, hidden_labels=0.75)
    unknown = (False, False)
    for epoch in range(3):
        counts = labelled(run.train_batches(epoch))
        assert counts[unknown] == round(0.75 * len(run.split.train))
        assert set(counts) == {unknown, (True, False), (False, True)}
    assert unknown not in labelled(run.test_batches(4))
    assert unknown not in labelled(run.train_windows(4))
    assert same(list(run.train_batches(0)), list(data(tmp_path).train_batches(0))), "the motion is the same"
    assert run.fingerprint == data(tmp_path).fingerprint


def test_every_tag_keeps_a_labelled_clip(tmp_path: Path) -> None:
    counts = labelled(data(tmp_path, hidden_labels=1.0).train_batches(0))
    assert counts[(True, False)] == counts[(False, True)] == 1
