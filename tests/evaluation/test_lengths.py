from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch import Tensor

from motiongen.contracts import Condition
from motiongen.data.datamodule import MotionData
from motiongen.evaluation.archive import Archive
from motiongen.evaluation.evaluator import Recorded, System, evaluate
from motiongen.evaluation.lengths import at_length
from motiongen.evaluation.protocol import Protocol
from motiongen.evaluation.results import REAL, Evaluation
from motiongen.evaluation.table import length_rows
from motiongen.recognition.recognizer import TrainedRecognizer
from tests.compositions import batch

SHORT, LONG = 25, 90
PROTOCOL = Protocol(seeds=2, batch_size=4, lengths=(SHORT, LONG))


class Replay:
    """Knows the real motion by the initial frames, cuts it or holds its last pose; remembers what it was asked for."""

    def __init__(self, data: MotionData) -> None:
        self.asked: list[tuple[int, int]] = []
        self._items = [data.test_items()[number] for number in range(len(data.test_items()))]

    def __call__(self, condition: Condition, seed: int) -> Tensor:
        frames = condition.mask.shape[1]
        self.asked.append((frames, seed))
        return torch.stack([self._motion(initial, frames) for initial in condition.initial_motion])

    def _motion(self, initial: Tensor, frames: int) -> Tensor:
        motion = next(item.motion for item in self._items if torch.equal(item.initial_motion, initial))
        return motion[torch.arange(frames).clamp(max=len(motion) - 1)]


def judged(data: MotionData, recognizer: TrainedRecognizer, protocol: Protocol = PROTOCOL) -> Evaluation:
    return evaluate({"replay": System(Replay(data))}, data, [recognizer], protocol)[0]


def test_the_same_length_is_the_same_condition() -> None:
    condition = batch((7, 7)).condition
    same = at_length(condition, 7)
    assert torch.equal(same.trajectory, condition.trajectory)
    assert torch.equal(same.mask, condition.mask)


@pytest.mark.parametrize("frames", [5, 10, 23])
def test_a_path_is_walked_at_another_pace(frames: int) -> None:
    """A straight path at constant pace from the origin stays one, and ends where it did, whatever the padding holds."""
    condition = batch((10, 6)).condition
    pace = torch.tensor([[0.1, -0.2], [0.3, 0.0]])
    path = torch.arange(1, 11).view(1, -1, 1) * pace.unsqueeze(1)
    path[1, 6:] = torch.nan
    other = at_length(replace(condition, trajectory=path), frames)
    ends = pace * torch.tensor([[10.0], [6.0]])
    done = torch.arange(1, frames + 1).view(1, -1, 1) / frames
    torch.testing.assert_close(other.trajectory, done * ends.unsqueeze(1))
    assert other.lengths.tolist() == [frames, frames]


def test_where_no_path_was_given_none_is() -> None:
    condition = batch((8,)).condition
    assert not at_length(replace(condition, trajectory=torch.zeros(1, 8, 2)), 13).trajectory.any()


def test_real_motion_of_a_length_scores_as_real_motion_of_that_length(
    data: MotionData, recognizer: TrainedRecognizer
) -> None:
    found = judged(data, recognizer)
    short, long = found.systems["replay"].lengths
    real = found.systems[REAL].lengths[0]
    assert (short.frames, short.same_length, short.count) == (SHORT, True, 6)
    assert short.values["fid"] == pytest.approx((0.0, 0.0), abs=1e-9)
    assert short.values["accuracy"] == real.values["accuracy"] * 2
    # No clip lasts 90 frames: held poses are compared with the test clips as they are.
    assert (long.same_length, long.count) == (False, 6)
    assert long.values["fid"][0] > 1e-3
    assert found.systems[REAL].lengths[1].values == {}


def test_lengths_change_no_other_figure_and_are_a_part_of_the_protocol(
    data: MotionData, recognizer: TrainedRecognizer
) -> None:
    plain = judged(data, recognizer, replace(PROTOCOL, lengths=())).to_json()
    asked = json.loads(json.dumps(judged(data, recognizer).to_json(), allow_nan=False))
    assert "lengths" not in plain["protocol"]
    assert asked["protocol"].pop("lengths") == [SHORT, LONG]
    for system in asked["systems"].values():
        assert [length["frames"] for length in system.pop("lengths")] == [SHORT, LONG]
    assert asked == json.loads(json.dumps(plain))


def test_a_tracker_gets_the_length_as_step(data: MotionData, recognizer: TrainedRecognizer) -> None:
    found = judged(data, recognizer)
    scalars = found.length_scalars()
    assert list(scalars) == [SHORT, LONG]
    assert set(scalars[LONG]) == {"replay/accuracy_at_length", "replay/fid_at_length"}
    assert set(scalars[SHORT]) == {"real/accuracy_at_length", *scalars[LONG]}
    rows = length_rows(found)
    assert [(row["frames"], row["FID to"], row["N"]) for row in rows] == [
        ("25", "this length", "6"),
        ("90", "all test clips", "6"),
    ]


def test_what_was_judged_is_not_generated_again(
    data: MotionData, recognizer: TrainedRecognizer, tmp_path: Path
) -> None:
    replay, archive = Replay(data), Archive(tmp_path)
    systems = {"replay": System(replay, "weights and settings")}
    evaluate(systems, data, [recognizer], replace(PROTOCOL, lengths=(SHORT,)), archive)
    # Batches of 4 and 2 clips; the noise of a seed is the same at every length.
    assert [seed for frames, seed in replay.asked if frames == SHORT] == [0, 1, 2, 3]
    replay.asked.clear()
    (found,) = evaluate(systems, data, [recognizer], replace(PROTOCOL, seeds=3), archive)
    assert [seed for frames, seed in replay.asked if frames == SHORT] == [4, 5]
    assert [seed for frames, seed in replay.asked if frames == LONG] == [0, 1, 2, 3, 4, 5]
    assert found.to_json() == judged(data, recognizer, replace(PROTOCOL, seeds=3)).to_json()


def test_recorded_motions_have_the_length_that_they_have(data: MotionData, recognizer: TrainedRecognizer) -> None:
    (found,) = evaluate({"recorded": Recorded(list(data.test_batches(4)))}, data, [recognizer], PROTOCOL)
    assert found.systems["recorded"].lengths == ()
    assert length_rows(found)[0]["N"] == "6"
