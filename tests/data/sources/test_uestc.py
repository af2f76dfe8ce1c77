from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motiongen.data.clips import DataError
from motiongen.data.sources.uestc import TRAINING_SUBJECTS, Uestc
from motiongen.data.splits import split
from motiongen.data.store import ClipStore
from tests.data.sources.miniatures import (
    Attack,
    Known,
    Video,
    check_upright,
    save_pickle,
    save_uestc,
    times,
    uestc_corpus,
)


def test_every_view_becomes_the_one_from_the_front(tmp_path: Path) -> None:
    motion = Known(4)
    views = {f"a{view}_d{view}_p001_c2_color.avi": view * math.pi / 4 for view in range(8)}
    videos = [Video(motion, "a9_d5_p001_c1_color.avi", 50)]
    videos += [Video(motion, name, 50, turned) for name, turned in views.items()]
    videos += [Video(motion, "a9_d8_p001_c2_color.avi", 50), Video(motion, "a8_d8_p001_c1_color.avi", 50)]
    source = Uestc(root=str(save_uestc(tmp_path, videos)))
    sequences = {sequence.name: sequence for sequence in source.sequences()}
    # View 8 goes round, but on the first side it is one from the front.
    assert set(sequences) == {video.name for video in videos} - {"a9_d8_p001_c2_color.avi"}
    for sequence in sequences.values():
        check_upright(sequence.features, source.skeleton(), motion.joints(times(50, 30.0)))
    assert sequences["a3_d3_p001_c2_color.avi"].segments[0].tags == ("exercise 3",)


def test_subjects_are_split_as_the_official_protocol_has_it(tmp_path: Path) -> None:
    assert len(TRAINING_SUBJECTS) == 51
    assert 118 - len(TRAINING_SUBJECTS) == 67
    store = ClipStore.open(Uestc(root=str(uestc_corpus(tmp_path))), tmp_path / "cache")
    result = split(store, 0, min_clips=2)
    subjects = [{store.sequences[clip.sequence].group for clip in side} for side in (result.train, result.test)]
    assert subjects == [{"p001", "p002", "p006"}, {"p003", "p004", "p005"}]
    assert split(store, 1, min_clips=2, test_share=0.1, test_cap=1) == result


def test_short_videos_are_tested_but_not_trained_on(tmp_path: Path) -> None:
    videos = [
        Video(Known(number), f"a0_d0_p{subject:03d}_c1_color.avi", frames)
        for number, (subject, frames) in enumerate([(1, 44), (2, 45), (3, 44), (4, 10)])
    ]
    root = save_uestc(tmp_path, videos)
    assert [one.group for one in Uestc(root=str(root)).sequences()] == ["p002", "p003", "p004"]
    assert len(Uestc(root=str(root), min_training_frames=44)) == 4


def test_frames_beyond_the_video_s_are_left_out(tmp_path: Path) -> None:
    root = save_uestc(tmp_path, [Video(Known(0), "a0_d0_p003_c1_color.avi", 50)])
    (root / "info" / "num_frames_min.txt").write_text("48\n")
    (sequence,) = Uestc(root=str(root)).sequences()
    assert len(sequence.features) == 48


@pytest.mark.parametrize(
    ("file", "change", "message"),
    [
        (
            "vibe_cache_refined.pkl",
            lambda content: content.pop("pose"),
            "'pose' is not a list of an entry for each",
        ),
        (
            "vibe_cache_refined.pkl",
            lambda content: content["joints3d"].pop(),
            "'joints3d' is not a list of an entry",
        ),
        (
            "vibe_cache_refined.pkl",
            lambda content: content["joints3d"].__setitem__(0, np.zeros((50, 24, 3))),
            r"a0_d0_p003_c1_color\.avi: field 'joints3d' has shape \(50, 24, 3\)",
        ),
        (
            "vibe_cache_refined.pkl",
            lambda content: content["pose"].__setitem__(0, content["pose"][0][:40]),
            "40 poses, 50 joints3d and 50 globtrans",
        ),
        (
            "vibe_cache_refined.pkl",
            lambda content: content["pose"][0].__setitem__((9, 0), np.nan),
            "field 'pose' is not finite at frame 9",
        ),
        ("vibe_cache_refined.pkl", lambda content: content.update(betas=Attack()), r"holds a posix\.system"),
        ("globtrans_usez.pkl", lambda content: content.pop(), "'globtrans' is not a list of an entry"),
        ("globtrans_usez.pkl", lambda content: content.__setitem__(0, np.zeros((50, 2))), r"has shape \(50, 2\)"),
    ],
)
def test_what_is_wrong_with_a_pickle_is_named(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    file: str,
    change: Callable[[Any], object],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    root = save_uestc(tmp_path, [Video(Known(0), "a0_d0_p003_c1_color.avi", 50)])
    content = pickle.loads((root / file).read_bytes())
    change(content)
    save_pickle(root / file, content)
    with pytest.raises(DataError, match=rf"{file}: .*{message}"):
        list(Uestc(root=str(root)).sequences())
    assert not Path("attacked").exists()


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("names.txt", "a0_d0_p003_color.avi", "names.txt:1: 'a0_d0_p003_color.avi' is not the name of a video"),
        ("names.txt", "a40_d0_p003_c1_color.avi", "names.txt:1: 'a40"),
        ("names.txt", "a0_d0_p119_c1_color.avi", "names.txt:1: 'a0_d0_p119"),
        ("num_frames_min.txt", "x", "num_frames_min.txt:1: 'x' is not a number of frames"),
        ("num_frames_min.txt", "50\n50", "num_frames_min.txt: 2 numbers for 1 names"),
    ],
)
def test_what_is_wrong_with_a_list_is_named(tmp_path: Path, file: str, text: str, message: str) -> None:
    root = save_uestc(tmp_path, [Video(Known(0), "a0_d0_p003_c1_color.avi", 50)])
    (root / "info" / file).write_text(text)
    with pytest.raises(DataError, match=message):
        Uestc(root=str(root))


def test_missing_files_are_named(tmp_path: Path) -> None:
    root = uestc_corpus(tmp_path)
    for name in ("info/names.txt", "globtrans_usez.pkl", "vibe_cache_refined.pkl"):
        (root / name).unlink()
        with pytest.raises(DataError, match=rf"{name}: the file is missing"):
            Uestc(root=str(root))
