from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motiongen.data.clips import DataError
from motiongen.data.sources.humanact12 import HumanAct12
from motiongen.data.splits import split
from motiongen.data.store import ClipStore
from motiongen.motion.skeleton import Skeleton
from tests.data.sources.miniatures import (
    FIGURE,
    Attack,
    Known,
    check_upright,
    humanact12,
    humanact12_corpus,
    save_pickle,
    times,
)

TALL = np.concatenate([1.2 * FIGURE, [[0.08, 0.0, 0.0], [-0.08, 0.0, 0.0]]])
"""SMPL's 24 joints of someone who is larger than the built-in figure."""


def test_joints_are_those_of_the_file_upright_and_on_the_floor(tmp_path: Path) -> None:
    clips = [(Known(seed), 3 * seed) for seed in range(3)]
    save_pickle(tmp_path / "humanact12poses.pkl", humanact12(clips, TALL, 50))
    source = HumanAct12(root=str(tmp_path))
    np.testing.assert_allclose(source.skeleton().offsets, TALL[:22], atol=1e-6)
    sequences = list(source.sequences())
    assert [sequence.segments[0].tags for sequence in sequences] == [("warm up",), ("jump",), ("sit",)]
    for sequence, (motion, _) in zip(sequences, clips, strict=True):
        check_upright(sequence.features, source.skeleton(), motion.joints(times(50, 30.0), TALL[:22]))


def test_another_rate_is_resampled_by_time(tmp_path: Path) -> None:
    save_pickle(tmp_path / "humanact12poses.pkl", humanact12([(Known(0), 1)], TALL, 46))
    (sequence,) = HumanAct12(root=str(tmp_path), fps=15.0).sequences()
    # Frames that were made a thirtieth of a second apart are now taken for a fifteenth.
    expected = Known(0).joints(times(91, 60.0), TALL[:22])
    check_upright(sequence.features, Skeleton(HumanAct12(root=str(tmp_path)).skeleton().offsets), expected)


def test_the_split_is_drawn_by_the_seed(tmp_path: Path) -> None:
    store = ClipStore.open(HumanAct12(root=str(humanact12_corpus(tmp_path))), tmp_path / "cache")
    first, second = split(store, 0), split(store, 1)
    assert first == split(store, 0) != second
    assert len(first.test) == 8
    assert len(first.train) == 32


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda content: content.pop("joints3D"), "field 'joints3D' is missing"),
        (lambda content: content["y"].pop(), "are not of the same length"),
        (lambda content: content["y"].__setitem__(1, 12), "clip 1: field 'y' is 12, not 0 to 11"),
        (lambda content: content["y"].__setitem__(1, "walk"), "clip 1: field 'y' is 'walk'"),
        (
            lambda content: content["poses"].__setitem__(1, np.zeros((30, 60))),
            r"'joints3D' has shape|shape \(30, 60",
        ),
        (
            lambda content: content["poses"][1].__setitem__((3, 4), np.nan),
            "clip 1: field 'poses' is not finite at frame 3",
        ),
        (
            lambda content: content["joints3D"][0].__setitem__((2, 4, 1), np.inf),
            "clip 0: field 'joints3D' is not finite",
        ),
        (lambda content: content["joints3D"].__setitem__(0, np.zeros((30, 22, 3))), r"has shape \(30, 22, 3\)"),
        (lambda content: content.update(y=Attack()), r"holds a posix\.system"),
    ],
)
def test_what_is_wrong_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: Callable[[Any], object], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    content = humanact12([(Known(0), 0), (Known(1), 1)], TALL, 30)
    change(content)
    save_pickle(tmp_path / "humanact12poses.pkl", content)
    with pytest.raises(DataError, match=rf"humanact12poses\.pkl: .*({message})"):
        list(HumanAct12(root=str(tmp_path)).sequences())
    assert not Path("attacked").exists()


def test_missing_and_cut_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"data\.source\.root: folder .*absent does not exist"):
        HumanAct12(root=str(tmp_path / "absent"))
    with pytest.raises(DataError, match=r"humanact12poses\.pkl: the file is missing"):
        HumanAct12(root=str(tmp_path))
    path = save_pickle(tmp_path / "humanact12poses.pkl", humanact12([(Known(0), 0)], TALL, 30))
    path.write_bytes(path.read_bytes()[:-1000])
    with pytest.raises(DataError, match=r"humanact12poses\.pkl: not a readable pickle"):
        list(HumanAct12(root=str(tmp_path)).sequences())
