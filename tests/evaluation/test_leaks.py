from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from motiongen.data.clips import Sequence
from motiongen.data.datamodule import MotionData
from motiongen.evaluation.leaks import LeakError, refuse_leaks, refuse_trained_clips
from motiongen.motion.canonical import GroundFrame
from tests.data.corpus import ListedSource, session


def corpus(count: int = 10) -> list[Sequence]:
    return [session(f"take{number}", [(0, 60, "walk")], 60) for number in range(count)]


def data(sequences: list[Sequence], cache: Path) -> MotionData:
    return MotionData(source=ListedSource(sequences), cache=str(cache))


def first_of_each_side(found: MotionData) -> tuple[int, int]:
    return found.split.train[0].sequence, found.split.test[0].sequence


def test_a_copied_piece_is_found_wherever_the_body_stands(tmp_path: Path) -> None:
    sequences = corpus()
    train, test = first_of_each_side(data(sequences, tmp_path / "clean"))
    refuse_leaks(data(sequences, tmp_path / "clean"))
    piece = GroundFrame(torch.tensor(0.7), torch.tensor([1.0, 2.0])).leave(sequences[test].features[20:45])
    features = sequences[train].features.clone()
    features[:25] = piece + 1e-7 * torch.randn(piece.shape, generator=torch.Generator().manual_seed(0))
    sequences[train] = replace(sequences[train], features=features)
    with pytest.raises(
        LeakError, match=rf"frames \d+ to \d+ of take{test}, a test clip, .* training clip take{train} "
    ):
        refuse_leaks(data(sequences, tmp_path / "leak"))


def test_a_rest_pose_that_all_takes_share_is_no_leak(tmp_path: Path) -> None:
    sequences = corpus()
    for number, sequence in enumerate(sequences):
        features = sequence.features.clone()
        features[:20] = 0.25
        sequences[number] = replace(sequence, features=features)
    refuse_leaks(data(sequences, tmp_path))


def test_a_generator_of_another_split_is_refused(tmp_path: Path) -> None:
    own, other = (MotionData(source=ListedSource(corpus(30)), cache=str(tmp_path), split_seed=seed) for seed in (0, 1))
    refuse_trained_clips(own.frames_of(own.split.train), own)
    with pytest.raises(LeakError, match=r"of take\d+ are a test clip, but the generator was trained on frames 0 to 59"):
        refuse_trained_clips(other.frames_of(other.split.train), own)


def test_frames_of_another_store_are_no_leak(tmp_path: Path) -> None:
    own = data(corpus(), tmp_path)
    refuse_trained_clips([("another store", *span[1:]) for span in own.frames_of(own.split.test)], own)
