from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motiongen.data.clips import DataError
from motiongen.data.sources.ntu13 import Ntu13
from motiongen.data.splits import split
from motiongen.data.store import ClipStore
from tests.data.sources.miniatures import (
    Attack,
    Known,
    check_upright,
    ntu13_corpus,
    save_ntu13,
    times,
    vibe,
)


@pytest.mark.parametrize("compress", [0, 3])
def test_joints_are_those_of_the_file_upright_and_on_the_floor(tmp_path: Path, compress: int) -> None:
    motion, when = Known(2), times(40, 30.0)
    found = {1: vibe(motion.turns(when), motion.pelvis(when)), 2: {}}
    root = save_ntu13(tmp_path, {"A/vibe/S001C002P003R002A099.pkl": found}, compress)
    source = Ntu13(root=str(root))
    (sequence,) = source.sequences()
    check_upright(sequence.features, source.skeleton(), motion.joints(when))
    assert sequence.segments[0].tags == ("run on the spot",)
    assert sequence.group == "P003"


def test_performers_stay_on_one_side(tmp_path: Path) -> None:
    store = ClipStore.open(Ntu13(root=str(ntu13_corpus(tmp_path))), tmp_path / "cache")
    result = split(store, 0)
    people = [{store.sequences[clip.sequence].group for clip in side} for side in (result.train, result.test)]
    assert result.tags == ("run on the spot", "throw")
    assert not people[0] & people[1]


def test_videos_of_nobody_are_left_out_with_the_reason(tmp_path: Path) -> None:
    someone = vibe(Known(0).turns(times(30, 30.0)), np.zeros((30, 3)))
    files = {f"S001C001P001R001A{action:03d}.pkl": {} if action < 8 else {1: someone} for action in (6, 7, 8, 9)}
    source = Ntu13(root=str(save_ntu13(tmp_path, files)))
    store = ClipStore.open(source, tmp_path / "cache", max_rejected=0.5)
    assert [sequence.name[-7:] for sequence in store.sequences] == ["008.pkl", "009.pkl"]
    assert list(store.quarantine.values()) == [f"{tmp_path / name}: VIBE found nobody" for name in list(files)[:2]]


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("S001A005.pkl", {}, "S001A005.pkl: the number after 'A' in the name is none of 6, 7"),
        ("S001.pkl", {}, "S001.pkl: the number after 'A'"),
        ("../S001A006.pkl", {}, "file '../S001A006.pkl' lies outside the folder"),
        ("S001A006.pkl", [1], "S001A006.pkl: holds a list"),
        ("S001A006.pkl", {1: {"pose": np.zeros((9, 72))}}, "S001A006.pkl: field 'joints3d' is missing"),
        ("S001A006.pkl", {1: {"joints3d": np.zeros((9, 49, 3))}}, "S001A006.pkl: field 'pose' is missing"),
        (
            "S001A006.pkl",
            {1: {"pose": np.zeros((9, 72)), "joints3d": np.zeros((8, 49, 3))}},
            "S001A006.pkl: 9 poses and 8 joints3d",
        ),
        ("S001A006.pkl", {1: Attack()}, r"S001A006.pkl: holds a posix\.system"),
    ],
)
def test_what_is_wrong_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, content: Any, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").mkdir()
    with pytest.raises(DataError, match=message):
        list(Ntu13(root=str(save_ntu13(tmp_path / "data", {name: content}))).sequences())
    assert not Path("attacked").exists()


def test_missing_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"ntu_vibe_list\.txt: the file is missing"):
        Ntu13(root=str(tmp_path))
    (tmp_path / "ntu_vibe_list.txt").write_text("S001A006.pkl\n")
    with pytest.raises(DataError, match=r"S001A006\.pkl: the file is missing"):
        Ntu13(root=str(tmp_path))
