"""HumanAct12, UESTC and NTU-13: poses that were estimated in a camera's coordinates."""

from __future__ import annotations

import logging
import math
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motiongen.data.clips import DataError
from motiongen.data.sources.humanact12 import HumanAct12
from motiongen.data.sources.ntu13 import Ntu13
from motiongen.data.sources.uestc import TRAINING_SUBJECTS, Uestc
from motiongen.data.splits import split
from motiongen.data.store import ClipStore
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.skeleton import JOINT, Skeleton
from tests.data.sources.miniatures import (
    FIGURE,
    Known,
    Video,
    humanact12,
    humanact12_corpus,
    ntu13_corpus,
    on_the_floor,
    save_ntu13,
    save_pickle,
    save_uestc,
    times,
    uestc_corpus,
    vibe,
)

TALL = np.concatenate([1.2 * FIGURE, [[0.08, 0.0, 0.0], [-0.08, 0.0, 0.0]]])
"""SMPL's 24 joints of someone who is larger than the built-in figure."""


def check_joints(features: Any, skeleton: Skeleton, expected: Any) -> None:
    found = joint_positions(features.double(), skeleton).numpy()
    np.testing.assert_allclose(found, on_the_floor(expected), atol=1e-4)
    assert (found[:, JOINT["head"], 2] > found[:, JOINT["pelvis"], 2] + 0.3).all()


class Attack:
    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, ("touch attacked",)


class TestHumanAct12:
    def test_joints_are_those_of_the_file_upright_and_on_the_floor(self, tmp_path: Path) -> None:
        clips = [(Known(seed), 3 * seed) for seed in range(3)]
        save_pickle(tmp_path / "humanact12poses.pkl", humanact12(clips, TALL, 50))
        source = HumanAct12(root=str(tmp_path))
        np.testing.assert_allclose(source.skeleton().offsets, TALL[:22], atol=1e-6)
        sequences = list(source.sequences())
        assert [sequence.segments[0].tags for sequence in sequences] == [("warm up",), ("jump",), ("sit",)]
        for sequence, (motion, _) in zip(sequences, clips, strict=True):
            check_joints(sequence.features, source.skeleton(), motion.joints(times(50, 30.0), TALL[:22]))

    def test_another_rate_is_resampled_by_time(self, tmp_path: Path) -> None:
        save_pickle(tmp_path / "humanact12poses.pkl", humanact12([(Known(0), 1)], TALL, 46))
        (sequence,) = HumanAct12(root=str(tmp_path), fps=15.0).sequences()
        # Frames that were made a thirtieth of a second apart are now taken for a fifteenth.
        expected = Known(0).joints(times(91, 60.0), TALL[:22])
        check_joints(sequence.features, Skeleton(HumanAct12(root=str(tmp_path)).skeleton().offsets), expected)

    def test_the_split_is_drawn_by_the_seed(self, tmp_path: Path) -> None:
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
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: Callable[[Any], object], message: str
    ) -> None:
        monkeypatch.chdir(tmp_path)
        content = humanact12([(Known(0), 0), (Known(1), 1)], TALL, 30)
        change(content)
        save_pickle(tmp_path / "humanact12poses.pkl", content)
        with pytest.raises(DataError, match=rf"humanact12poses\.pkl: .*({message})"):
            list(HumanAct12(root=str(tmp_path)).sequences())
        assert not Path("attacked").exists()

    def test_missing_and_cut_files_are_named(self, tmp_path: Path) -> None:
        with pytest.raises(DataError, match=r"data\.source\.root: folder .*absent does not exist"):
            HumanAct12(root=str(tmp_path / "absent"))
        with pytest.raises(DataError, match=r"humanact12poses\.pkl: the file is missing"):
            HumanAct12(root=str(tmp_path))
        path = save_pickle(tmp_path / "humanact12poses.pkl", humanact12([(Known(0), 0)], TALL, 30))
        path.write_bytes(path.read_bytes()[:-1000])
        with pytest.raises(DataError, match=r"humanact12poses\.pkl: not a readable pickle"):
            list(HumanAct12(root=str(tmp_path)).sequences())


class TestUestc:
    def test_every_view_becomes_the_one_from_the_front(self, tmp_path: Path) -> None:
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
            check_joints(sequence.features, source.skeleton(), motion.joints(times(50, 30.0)))
        assert sequences["a3_d3_p001_c2_color.avi"].segments[0].tags == ("exercise 3",)

    def test_subjects_are_split_as_the_official_protocol_has_it(self, tmp_path: Path) -> None:
        assert len(TRAINING_SUBJECTS) == 51
        assert 118 - len(TRAINING_SUBJECTS) == 67
        store = ClipStore.open(Uestc(root=str(uestc_corpus(tmp_path))), tmp_path / "cache")
        result = split(store, 0, min_clips=2)
        subjects = [{store.sequences[clip.sequence].group for clip in side} for side in (result.train, result.test)]
        assert subjects == [{"p001", "p002", "p006"}, {"p003", "p004", "p005"}]
        assert split(store, 1, min_clips=2, test_share=0.1, test_cap=1) == result

    def test_short_videos_are_tested_but_not_trained_on(self, tmp_path: Path) -> None:
        videos = [
            Video(Known(number), f"a0_d0_p{subject:03d}_c1_color.avi", frames)
            for number, (subject, frames) in enumerate([(1, 44), (2, 45), (3, 44), (4, 10)])
        ]
        root = save_uestc(tmp_path, videos)
        assert [one.group for one in Uestc(root=str(root)).sequences()] == ["p002", "p003", "p004"]
        assert len(Uestc(root=str(root), min_training_frames=44)) == 4

    def test_frames_beyond_the_video_s_are_left_out(self, tmp_path: Path) -> None:
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
        self,
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
    def test_what_is_wrong_with_a_list_is_named(self, tmp_path: Path, file: str, text: str, message: str) -> None:
        root = save_uestc(tmp_path, [Video(Known(0), "a0_d0_p003_c1_color.avi", 50)])
        (root / "info" / file).write_text(text)
        with pytest.raises(DataError, match=message):
            Uestc(root=str(root))

    def test_missing_files_are_named(self, tmp_path: Path) -> None:
        root = uestc_corpus(tmp_path)
        for name in ("info/names.txt", "globtrans_usez.pkl", "vibe_cache_refined.pkl"):
            (root / name).unlink()
            with pytest.raises(DataError, match=rf"{name}: the file is missing"):
                Uestc(root=str(root))


class TestNtu13:
    @pytest.mark.parametrize("compress", [0, 3])
    def test_joints_are_those_of_the_file_upright_and_on_the_floor(self, tmp_path: Path, compress: int) -> None:
        motion, when = Known(2), times(40, 30.0)
        found = {1: vibe(motion.turns(when), motion.pelvis(when)), 2: {}}
        root = save_ntu13(tmp_path, {"A/vibe/S001C002P003R002A099.pkl": found}, compress)
        source = Ntu13(root=str(root))
        (sequence,) = source.sequences()
        check_joints(sequence.features, source.skeleton(), motion.joints(when))
        assert sequence.segments[0].tags == ("run on the spot",)
        assert sequence.group == "P003"

    def test_performers_stay_on_one_side(self, tmp_path: Path) -> None:
        store = ClipStore.open(Ntu13(root=str(ntu13_corpus(tmp_path))), tmp_path / "cache")
        result = split(store, 0)
        people = [{store.sequences[clip.sequence].group for clip in side} for side in (result.train, result.test)]
        assert result.tags == ("run on the spot", "throw")
        assert not people[0] & people[1]

    def test_videos_of_nobody_are_told_once(self, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
        someone = vibe(Known(0).turns(times(30, 30.0)), np.zeros((30, 3)))
        files = {f"S001C001P001R001A{action:03d}.pkl": {} if action < 9 else {1: someone} for action in (6, 7, 8, 9)}
        with caplog.at_level(logging.WARNING):
            assert len(list(Ntu13(root=str(save_ntu13(tmp_path, files))).sequences())) == 1
        assert caplog.messages == [f"{tmp_path}: VIBE found nobody in 3 of 4 files"]

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
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, content: Any, message: str
    ) -> None:
        monkeypatch.chdir(tmp_path)
        (tmp_path / "data").mkdir()
        with pytest.raises(DataError, match=message):
            list(Ntu13(root=str(save_ntu13(tmp_path / "data", {name: content}))).sequences())
        assert not Path("attacked").exists()

    def test_missing_files_are_named(self, tmp_path: Path) -> None:
        with pytest.raises(DataError, match=r"ntu_vibe_list\.txt: the file is missing"):
            Ntu13(root=str(tmp_path))
        (tmp_path / "ntu_vibe_list.txt").write_text("S001A006.pkl\n")
        with pytest.raises(DataError, match=r"S001A006\.pkl: the file is missing"):
            Ntu13(root=str(tmp_path))
