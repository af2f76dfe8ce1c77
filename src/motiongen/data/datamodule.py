"""The data of one run: a store, its split, and batches."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence as Ordered
from pathlib import Path
from typing import Annotated

import numpy as np
import torch
from torch.utils.data import DataLoader

from motiongen.contracts import MotionBatch
from motiongen.data.clips import INITIAL_FRAMES, DataError, Source, Span
from motiongen.data.dataset import Item, MotionDataset, bucketed, collate, random_window
from motiongen.data.splits import Clip, all_clips, split, validation_split, without_labels
from motiongen.data.store import MAX_REJECTED, ClipStore
from motiongen.data.transitions import draw_transition
from motiongen.errors import InputError
from motiongen.motion.skeleton import Skeleton
from motiongen.options import PositiveInt, Range, Share


class MotionData:
    """A data set, split and windowed, as batches.

    Training draws `draws` new windows of at most `max_frames` from every training clip in every epoch, each as long as
    the clip allows or, with `random_length`, of any length from `min_frames` on; with `train_frames`, of at most that
    many frames, so that a training on short windows can be judged on those of another. The share `beginnings` of them
    starts where its clip does, as an action that is asked for does: drawn at random, beginnings of long clips are rare.
    Test clips are cut into consecutive windows once. Windows and batches follow from the seed and the epoch,
    the split and the hidden labels from `split_seed` alone, so that trainings with several seeds compare.

    With `validation_share`, that share of the training clips takes the place of the test clips, which are left out: for
    choosing settings without a look at the test clips.

    The share `transitions` of the windows is made to begin from poses of other training clips, so that actions are seen
    to follow ones that they never followed when they were recorded, and to come back from drift.

    Of the training clips, the share `hidden_labels` comes without tags and styles in `train_batches`, the same clips in
    every epoch, for generators that learn from unlabelled motion too. Nothing else hides labels.

    Damaged parts of the source are left out, unless they are more than the share `max_rejected`. A source that was not
    prepared yet is read by `prepare_workers` processes: 0 reads in this one, None takes one for every thread that
    PyTorch may use if it is going to take long. Training batches are made by `workers` processes, or in this one.

    Raises:
        InputError: `max_frames` below `min_frames`, or `train_frames` not between the two.
        DataError: the source is missing or damaged, or has no tag that can be on both sides of the split.
        LostReader: a process that read the source was killed.
    """

    def __init__(
        self,
        *,
        source: Source,
        cache: str,
        seed: int = 0,
        split_seed: int = 0,
        batch_size: PositiveInt = 30,
        max_frames: PositiveInt = 240,
        min_frames: PositiveInt = 20,
        validation_share: Share = 0.0,
        test_share: Share = 0.2,
        test_cap: PositiveInt = 100,
        min_clips: PositiveInt = 5,
        draws: PositiveInt = 1,
        random_length: bool = False,
        train_frames: PositiveInt | None = None,
        beginnings: Share = 0.0,
        transitions: Share = 0.0,
        hidden_labels: Share = 0.0,
        max_rejected: Share = MAX_REJECTED,
        prepare_workers: Annotated[int, Range(0)] | None = None,
        workers: Annotated[int, Range(0)] = 0,
    ) -> None:
        if max_frames < min_frames:
            raise InputError(f"data.max_frames ({max_frames}) is below data.min_frames ({min_frames})")
        if train_frames is not None and not min_frames <= train_frames <= max_frames:
            raise InputError(f"data.train_frames ({train_frames}) is not within data.min_frames and data.max_frames")
        self.name = source.name
        self.store = ClipStore.open(source, Path(cache), max_rejected, prepare_workers)
        self.split = split(
            self.store,
            split_seed,
            test_share=test_share,
            test_cap=test_cap,
            min_clips=min_clips,
            min_frames=min_frames,
        )
        if validation_share:
            self.split = validation_split(
                self.store, self.split, split_seed, share=validation_share, min_frames=min_frames
            )
        self._seed = seed
        self._batch_size = batch_size
        self._max_frames = max_frames
        self._min_frames = min_frames
        self._train_frames = train_frames or max_frames
        self._draws = draws
        self._shortest = min_frames if random_length else None
        self._beginnings = beginnings
        self._transitions = transitions
        self._workers = workers
        self._hidden = without_labels(self.store, self.split, hidden_labels, split_seed)

    @property
    def tags(self) -> tuple[str, ...]:
        """Names of the columns of every tag vector."""
        return self.split.tags

    @property
    def styles(self) -> tuple[str, ...]:
        """Names of the columns of every style vector; none for data without styles."""
        return self.store.styles

    @property
    def skeleton(self) -> Skeleton:
        return self.store.skeleton

    @property
    def fingerprint(self) -> str:
        """Hex digest of everything that decides which frames are trained and tested on, and under which labels."""
        sides = [
            [(c.sequence, c.segment, c.start, c.stop) for c in side] for side in (self.split.train, self.split.test)
        ]
        windows = [self._max_frames, self._min_frames]
        parts = [self.store.fingerprint, self.tags, sides, windows]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()

    def frames_of(self, clips: Ordered[Clip]) -> tuple[Span, ...]:
        """Where these clips and their initial motions lie, in a form that outlives this object."""
        return tuple(
            (self.store.fingerprint, self.store.sequences[clip.sequence].name, clip.initial_start, clip.stop)
            for clip in clips
        )

    def train_batches(self, epoch: int) -> DataLoader[Item]:
        """The batches of one epoch: MotionBatch objects, in an order and of windows that only (seed, epoch) decide."""
        windows = [
            random_window(
                clip,
                self._train_frames,
                np.random.default_rng((self._seed, epoch, index)),
                self._shortest,
                self._beginnings,
            )
            for index, clip in enumerate(self.split.train * self._draws)
        ]
        rng = np.random.default_rng((self._seed, epoch))
        (draw,) = rng.spawn(1)
        joined = np.flatnonzero(draw.random(len(windows)) < self._transitions).tolist()
        transitions = {index: draw_transition(self.split.train, draw) for index in joined}
        dataset = MotionDataset(self.store, self.tags, windows, self._hidden, transitions)
        batches = bucketed([len(clip) for clip in windows], self._batch_size, rng)
        return _loader(dataset, batches, self._workers)

    def test_batches(self, batch_size: int) -> DataLoader[Item]:
        """All test windows, the shortest first, in the same batches every time."""
        items = self.test_items()
        return _in_order(items, _shortest_first(items), batch_size)

    def test_takes(self) -> torch.Tensor:
        """(N,) which group of takes each clip of `test_batches` was cut from, numbered from 0."""
        items = self.test_items()
        groups = [self.store.sequences[clip.sequence].group for clip in items.clips]
        numbers = {group: number for number, group in enumerate(dict.fromkeys(groups))}
        return torch.tensor([numbers[groups[index]] for index in _shortest_first(items)])

    def test_windows(self, frames: int, batch_size: int) -> DataLoader[Item]:
        """Motions of exactly `frames`, each from where one of the `test_items` begins, if its clip lasts so long."""
        windows = [
            clip.window(part.start, part.start + frames)
            for clip in self.split.test
            for part in clip.windows(self._max_frames, self._min_frames)
            if part.start + frames <= clip.stop
        ]
        items = MotionDataset(self.store, self.tags, windows)
        return _in_order(items, range(len(items)), batch_size)

    def outside(self, source: Source, cache: Path, batch_size: int) -> list[MotionBatch]:
        """Motions of another source, cut into windows as test clips are, in batches with this data's tags.

        Raises:
            DataError: the source is damaged, bears a tag that this data has not, or has no motion that is long enough.
        """
        store = ClipStore.open(source, cache)
        for sequence in store.sequences:
            for tag in sequence.segments[0].tags:
                if tag not in self.tags:
                    raise DataError(f"{source.name}: {sequence.name}: tag {tag!r} is none of {', '.join(self.tags)}")
        windows = [part for clip in all_clips(store, 1) for part in clip.windows(self._max_frames, self._min_frames)]
        if not windows:
            raise DataError(f"{source.name}: no motion has {self._min_frames} frames after the {INITIAL_FRAMES} first")
        items = MotionDataset(store, self.tags, windows)
        return list(_in_order(items, _shortest_first(items), batch_size))

    def train_items(self) -> MotionDataset:
        """Training clips in consecutive windows, as test clips are cut."""
        return self._items(self.split.train)

    def train_windows(self, batch_size: int) -> DataLoader[Item]:
        """The `train_items`, each once, in batches."""
        items = self.train_items()
        return _in_order(items, range(len(items)), batch_size)

    def test_clips(self) -> MotionDataset:
        """Test clips as they are, however long, in the order of the store."""
        return MotionDataset(self.store, self.tags, self.split.test)

    def test_items(self) -> MotionDataset:
        """Test clips in consecutive windows, in the order of the store."""
        return self._items(self.split.test)

    def _items(self, clips: Ordered[Clip]) -> MotionDataset:
        windows = [part for clip in clips for part in clip.windows(self._max_frames, self._min_frames)]
        return MotionDataset(self.store, self.tags, windows)


def _shortest_first(items: MotionDataset) -> list[int]:
    return sorted(range(len(items)), key=lambda index: len(items.clips[index]))


def _in_order(items: MotionDataset, order: Ordered[int], batch_size: int) -> DataLoader[Item]:
    return _loader(items, [list(order[start : start + batch_size]) for start in range(0, len(order), batch_size)])


def _loader(items: MotionDataset, batches: list[list[int]], workers: int = 0) -> DataLoader[Item]:
    # A generator of its own keeps the loader from drawing on torch's global one, which training's noise may use.
    return DataLoader(
        items, batch_sampler=batches, collate_fn=collate, generator=torch.Generator(), num_workers=workers
    )
