"""Leak-free splits: whole groups of sequences go to one side, and every tag is on both."""

from __future__ import annotations

import logging
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from motiongen.data.clips import INITIAL_FRAMES, DataError
from motiongen.data.store import ClipStore

_log = logging.getLogger(__name__)

SPLIT_FRAMES = 20
"""Clips of fewer frames have no say in which groups are tested. Fixed, so that the sides are the same for every window
length: a model trained on 60 frames may be tested on the clips of 20."""

SegmentKey = tuple[int, int]
"""A segment of a store: its sequence's place, and its own in the sequence."""


@dataclass(frozen=True)
class Clip:
    """Frames [start, stop) of a sequence that show a segment or a window of it, and the start of its initial motion."""

    sequence: int
    segment: int
    start: int
    stop: int
    initial_start: int

    def __len__(self) -> int:
        return self.stop - self.start

    @property
    def key(self) -> SegmentKey:
        """The segment that it shows."""
        return self.sequence, self.segment

    def window(self, start: int, stop: int) -> Clip:
        """A part of this clip; its initial motion is the frames just before it."""
        return replace(self, start=start, stop=stop, initial_start=start - INITIAL_FRAMES)

    def windows(self, max_frames: int, min_frames: int) -> list[Clip]:
        """Consecutive windows of at most `max_frames`; a rest below `min_frames` is dropped."""
        starts = range(self.start, self.stop, max_frames)
        parts = [self.window(start, min(start + max_frames, self.stop)) for start in starts]
        return [part for part in parts if len(part) >= min_frames]


@dataclass(frozen=True)
class Split:
    """Training and test clips in the order of the store."""

    train: tuple[Clip, ...]
    test: tuple[Clip, ...]
    tags: tuple[str, ...]
    """The tags that are on both sides, sorted."""
    left_out: dict[str, str]
    """Tags that are on neither side, with the reason."""


def split(
    store: ClipStore,
    seed: int,
    *,
    test_share: float = 0.2,
    test_cap: int = 100,
    min_clips: int = 5,
    min_frames: int = 20,
) -> Split:
    """Choose groups for the test side so that each tag has close to `test_share` of its clips there.

    A clip starts where its segment does and takes the 6 frames before as its initial motion; at the start of a sequence
    the first 6 frames are the initial motion and the clip starts after them.

    Groups are chosen greedily: first, rarest tag first, one group for every tag; then, as long as it brings the counts
    closer to their targets, the group that does so most for each of its clips. Clips of SPLIT_FRAMES decide; which of
    them `min_frames` keeps has no influence, so that no clip changes sides with it.

    Groups hold frequent tags beside rare ones. What they have of a frequent tag beyond `test_cap` is on neither side.

    A data set's own split (`Sequence.side`) is kept as it is; seed, share and cap have no say in it.

    Args:
        store: the clips.
        seed: decides among equals.
        test_share: the share to test, 0 to 1.
        test_cap: no tag has more test clips than this.
        min_clips: tags with fewer clips are left out, as are those that cannot be on both sides.
        min_frames: clips that are shorter are on neither side. A tag that has none left on one side is left out.

    Raises:
        DataError: no tag can be on both sides, or the data set's own split has a group on both or leaves sequences out.
    """
    clips = all_clips(store, SPLIT_FRAMES)
    official = _official(store)
    chosen, tags, left_out = _tested_groups(store, clips, seed, test_share, test_cap, min_clips, official)
    tested = [clip for clip in clips if store.sequences[clip.sequence].group in chosen]
    surplus = set() if official else _surplus(store, tested, tags, seed, test_cap)
    kept = [clip for clip in all_clips(store, min_frames) if clip.key not in surplus]
    return _sides(store, kept, chosen, tags, left_out, min_frames)


def validation_split(store: ClipStore, split: Split, seed: int, *, share: float, min_frames: int) -> Split:
    """A split of the training side alone: what is chosen by its test clips has not seen those of the data.

    Args:
        store: the clips.
        split: whose training side is divided; its test clips are on neither side.
        seed: decides among equals.
        share: the share to validate with, 0 to 1.
        min_frames: as in `split`.

    Raises:
        DataError: no tag can be on both sides.
    """
    chosen, tags, left_out = _tested_groups(store, split.train, seed, share, len(split.train), 2, set())
    return _sides(store, split.train, chosen, tags, left_out, min_frames)


def _tested_groups(
    store: ClipStore,
    clips: Sequence[Clip],
    seed: int,
    share: float,
    cap: int,
    min_clips: int,
    official: set[str],
) -> tuple[set[str], tuple[str, ...], dict[str, str]]:
    """The groups to test, the tags that are on both sides then, and those that are not, with the reason.

    Those that the data set's own split tests (`official`), if it has one, whatever seed, share and cap are.
    """
    tags_of = [store.sequences[clip.sequence].segments[clip.segment].tags for clip in clips]
    left_out: dict[str, str] = {}
    while True:
        count = {tag: sum(tag in own for own in tags_of) for tag in store.tags if tag not in left_out}
        rare = {tag: f"{number} clips, fewer than {min_clips}" for tag, number in count.items() if number < min_clips}
        left_out |= rare
        tags = tuple(tag for tag in count if tag not in rare)
        if not tags:
            raise DataError(f"no tag has clips on both sides of a split: {left_out}")
        groups: dict[str, list[tuple[str, ...]]] = defaultdict(list)
        for clip, own in zip(clips, tags_of, strict=True):
            counted = tuple(tag for tag in own if tag in tags)
            if counted:
                groups[store.sequences[clip.sequence].group].append(counted)
        outcome = official or _choose(groups, tags, np.random.default_rng(seed), share, cap)
        if not isinstance(outcome, str):
            return outcome, tags, left_out
        left_out[outcome] = "no group of its sequences can be tested without taking a tag out of training"


def _surplus(store: ClipStore, tested: Sequence[Clip], tags: Sequence[str], seed: int, cap: int) -> set[SegmentKey]:
    """Clips to take from the test side so that no tag has more than `cap`; those of rare tags stay first."""
    counted = [_tags(store, [clip]) & set(tags) for clip in tested]
    total = Counter(tag for own in counted for tag in own)
    shuffled = np.random.default_rng(seed).permutation(len(tested)).tolist()
    left = Counter(dict.fromkeys(tags, cap))
    surplus = set()
    for place in sorted(shuffled, key=lambda place: min((total[tag] for tag in counted[place]), default=0)):
        if all(left[tag] for tag in counted[place]):
            left.subtract(counted[place])
        else:
            surplus.add(tested[place].key)
    return surplus


def _sides(
    store: ClipStore,
    kept: Sequence[Clip],
    chosen: set[str],
    tags: tuple[str, ...],
    left_out: dict[str, str],
    min_frames: int,
) -> Split:
    """The clips on their sides."""
    tested = [clip for clip in kept if store.sequences[clip.sequence].group in chosen]
    trained = [clip for clip in kept if store.sequences[clip.sequence].group not in chosen]
    on_both = _tags(store, trained) & _tags(store, tested)
    left_out |= {tag: f"no clip of {min_frames} frames on one side" for tag in tags if tag not in on_both}
    tags = tuple(tag for tag in tags if tag in on_both)
    if not tags:
        raise DataError(f"no tag has clips of {min_frames} frames on both sides of the split")
    for tag, reason in left_out.items():
        _log.warning("The split leaves out the tag %s: %s", tag, reason)
    return Split(
        train=tuple(clip for clip in trained if _tags(store, [clip]) & set(tags)),
        test=tuple(clip for clip in tested if _tags(store, [clip]) & set(tags)),
        tags=tags,
        left_out=left_out,
    )


def without_labels(store: ClipStore, split: Split, share: float, seed: int) -> frozenset[SegmentKey]:
    """Training segments to hide the labels of: close to `share` of them, but of every tag at least one keeps its own.

    Args:
        store: the clips.
        split: whose training side is meant.
        share: 0 to 1.
        seed: decides which.
    """
    tags_of = [store.sequences[clip.sequence].segments[clip.segment].tags for clip in split.train]
    shown = Counter(tag for tags in tags_of for tag in tags)
    hidden: set[SegmentKey] = set()
    for place in np.random.default_rng(seed).permutation(len(split.train)):
        if len(hidden) >= round(share * len(split.train)):
            break
        if all(shown[tag] > 1 for tag in tags_of[place]):
            shown.subtract(tags_of[place])
            hidden.add(split.train[place].key)
    return frozenset(hidden)


def all_clips(store: ClipStore, min_frames: int) -> list[Clip]:
    """Every segment of at least `min_frames` frames after its initial motion, in the order of the store."""
    clips = []
    for index, sequence in enumerate(store.sequences):
        for number, segment in enumerate(sequence.segments):
            start = max(segment.start, INITIAL_FRAMES)
            if segment.stop - start >= min_frames:
                clips.append(Clip(index, number, start, segment.stop, start - INITIAL_FRAMES))
    return clips


def _tags(store: ClipStore, clips: Iterable[Clip]) -> set[str]:
    """The tags of these clips."""
    return {tag for clip in clips for tag in store.sequences[clip.sequence].segments[clip.segment].tags}


def _official(store: ClipStore) -> set[str]:
    """The names of the groups that the data set's own split tests; none where it has no split."""
    groups = {
        side: {sequence.group for sequence in store.sequences if sequence.side == side}
        for side in ("train", "test", None)
    }
    if both := groups["train"] & groups["test"]:
        raise DataError(f"the data set's own split has the group {min(both)} on both sides")
    if groups[None] and (groups["train"] or groups["test"]):
        raise DataError(f"the data set's own split leaves out the group {min(groups[None])}")
    if groups["train"] and not groups["test"]:
        raise DataError("the data set's own split has nothing to test")
    return groups["test"]


def _choose(
    groups: dict[str, list[tuple[str, ...]]], tags: tuple[str, ...], rng: np.random.Generator, share: float, cap: int
) -> set[str] | str:
    """The names of the groups to test, or the tag that cannot be on both sides. `groups`: the tags of each clip.

    Of a tag that is to have `cap` test clips, more do no harm: they are taken away afterwards.
    """
    names = sorted(groups)
    names = [names[place] for place in rng.permutation(len(names))]
    counts = np.array([[sum(tag in own for own in groups[name]) for tag in tags] for name in names])  # (groups, tags)
    sizes = np.array([len(groups[name]) for name in names])
    total = counts.sum(axis=0)
    target = np.clip(np.rint(share * total), 1, cap)
    test = np.zeros(len(tags), dtype=int)
    free = np.ones(len(names), dtype=bool)

    def gains() -> np.ndarray:
        """By how much each group brings the counts closer to the targets, per clip; -inf where not allowed."""
        after = test + counts
        closer = (np.abs(np.minimum(test, cap) - target) - np.abs(np.minimum(after, cap) - target)) / target
        # Rounded, so that equal gains are equal and the seeded order decides.
        gain = np.round(closer.sum(axis=1) / sizes, 9)
        leaves_training = ((total - after > 0) | (counts == 0)).all(axis=1)
        return np.where(free & leaves_training, gain, -np.inf)

    def take(place: int) -> None:
        free[place] = False
        test[:] += counts[place]

    for tag in np.argsort(total, kind="stable"):
        if test[tag] == 0:
            gain = np.where(counts[:, tag] > 0, gains(), -np.inf)
            if np.isneginf(gain.max()):
                return tags[tag]
            take(int(gain.argmax()))
    while (gain := gains()).max() > 0:
        take(int(gain.argmax()))
    return {name for name, is_free in zip(names, free, strict=True) if not is_free}
