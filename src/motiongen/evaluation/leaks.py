"""Whether test clips were trained on, found out from the frames themselves and not from names."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from motiongen.data.clips import Span
from motiongen.data.splits import Clip
from motiongen.errors import InputError
from motiongen.motion.representation import ROTATION

if TYPE_CHECKING:
    from motiongen.data.datamodule import MotionData

RUN = 8
"""Frames in a row that have to be the same: one pose alone may be met twice."""
DECIMALS = 3
"""Entries of 6D rotations are rounded to so many. Copies through text files differ in the sixth; then a third of the
runs still agree in all of their entries, and one is enough."""
JOINTS_COMPARED = slice(6, ROTATION.stop)
"""All rotations but the pelvis': a copy may be moved and turned."""


class LeakError(InputError):
    """A test clip lies, as a whole or in part, in the training set."""


def refuse_leaks(data: MotionData) -> None:
    """Compare the frames of all test clips, their initial motion included, with those of all training clips.

    A run of RUN frames whose local rotations agree to DECIMALS is taken for a copy, wherever the body stands. Runs
    without movement are left out, as a rest pose can be everywhere; a copy in which nothing moves is not found.

    Raises:
        LeakError: naming the first such test clip, its frames, and the training clip that holds them.
    """
    trained: dict[int, Clip] = {}
    for clip, _, run in _runs(data, data.split.train):
        trained.setdefault(run, clip)
    for clip, frame, run in _runs(data, data.split.test):
        if run in trained:
            tested, source = (data.store.sequences[one.sequence].name for one in (clip, trained[run]))
            raise LeakError(
                f"data {data.name}: frames {frame} to {frame + RUN - 1} of {tested}, a test clip, lie in the training "
                f"clip {source} too; figures of this split would mean nothing. Give the two sequences one group"
            )


def refuse_trained_clips(trained_on: Iterable[Span], data: MotionData) -> None:
    """Check that a generator from another run has not seen the test clips of this data, as another split would have it.

    Raises:
        LeakError: naming the first test clip that shares frames with what the generator was trained on.
    """
    trained: dict[tuple[str, str], list[tuple[int, int]]] = defaultdict(list)
    for store, sequence, start, stop in trained_on:
        trained[store, sequence].append((start, stop))
    for store, sequence, start, stop in data.frames_of(data.split.test):
        for trained_start, trained_stop in trained[store, sequence]:
            if start < trained_stop and trained_start < stop:
                raise LeakError(
                    f"data {data.name}: frames {start} to {stop - 1} of {sequence} are a test clip, but the generator "
                    f"was trained on frames {trained_start} to {trained_stop - 1}; evaluate it on the split of its run "
                    "(data, seed, data.test_share, data.test_cap and data.min_clips as they were)"
                )


def _runs(data: MotionData, clips: Iterable[Clip]) -> Iterator[tuple[Clip, int, int]]:
    """Every moving run of RUN frames: its clip, its first frame in the sequence, and a number for its content."""
    for clip in clips:
        frames = data.store.features(clip.sequence, clip.initial_start, clip.stop)[:, JOINTS_COMPARED].numpy()
        hashes = [hash(row.tobytes()) for row in _rounded(frames)]
        for start in range(len(hashes) - RUN + 1):
            run = hashes[start : start + RUN]
            if len(set(run)) > 1:
                yield clip, clip.initial_start + start, hash(tuple(run))


def _rounded(frames: NDArray[np.float32]) -> NDArray[np.int32]:
    return np.rint(frames * 10**DECIMALS).astype(np.int32)
