from __future__ import annotations

import math

import pytest
import torch

from motiongen.evaluation.judgement import Judge
from motiongen.evaluation.long_motion import Act, acts_of, judge_acts
from motiongen.evaluation.long_results import (
    curve_rows,
    long_rows,
    long_scalars,
    long_training_rows,
    summarized,
    to_json,
)
from motiongen.motion.canonical import GroundFrame
from motiongen.motion.skeleton import FEET
from motiongen.recognition.recognizer import Recognizer, RecognizerOutput
from motiongen.synthesis.pipeline import LongMotion
from tests.compositions import skeleton
from tests.motion.poses import standing


class Height(Recognizer):
    """Takes a body above a metre for tag 1, others for tag 0; keeps what it saw."""

    def __init__(self):
        super().__init__()
        self.seen = []

    def forward(self, motion, mask):
        self.seen.append((motion, mask))
        height = (motion[..., -1] * mask).sum(dim=1) / mask.sum(dim=1)
        return RecognizerOutput(torch.stack([1 - height, height - 1], dim=1), motion[:, :1, -3:].flatten(1))


def judge() -> Judge:
    from motiongen.motion.kinematics import joint_positions

    resting = joint_positions(standing(1), skeleton())[0, list(FEET), 2]
    return Judge(Height(), skeleton(), torch.tensor([False, False]), resting, 0.05, 0.0)


def rise(frames: int, height: float = 0.0) -> torch.Tensor:
    motion = standing(frames)
    motion[:, -1] += height
    return motion


LOW, HIGH = torch.eye(2)


def test_actions_are_cut_from_long_motions():
    motion = LongMotion(torch.arange(20.0).unsqueeze(1).expand(20, 135), (6, 11, 20), (False, False), None)
    first, second = acts_of([motion], [[LOW, HIGH]], 6)
    assert (first.sequence, first.index, second.index) == (0, 0, 1)
    assert first.before[:, 0].tolist() == [0, 1, 2, 3, 4, 5]
    assert second.before[:, 0].tolist() == [5, 6, 7, 8, 9, 10]
    assert second.motion[:, 0].tolist() == list(range(11, 20))


def test_long_actions_are_recognized_in_parts_each_in_its_canonical_frame():
    own = judge()
    frame = GroundFrame(torch.tensor(1.0), torch.tensor([4.0, 5.0]))
    act = Act(0, 0, LOW, frame.leave(rise(6)), frame.leave(rise(25)))
    judged = judge_acts([act], own, longest=10)
    ((motion, mask),) = own.recognizer.seen
    assert mask.sum(dim=1).tolist() == [9, 8, 8]
    torch.testing.assert_close(motion[0], rise(9), atol=1e-5, rtol=0)
    assert judged.logits.shape == (1, 2)
    assert judged.features.shape == (3, 3)
    assert judged.part_index.tolist() == [0, 0, 0]


def test_figures_of_a_seam_and_of_the_floor():
    smooth = Act(0, 0, LOW, rise(6), rise(12))
    raised = Act(0, 1, LOW, rise(6), rise(3, 0.2))
    values = judge_acts([smooth, raised], judge(), longest=60).values
    assert values["pose_gap"].tolist() == pytest.approx([0, 20], abs=1e-4)
    assert values["velocity_gap"].tolist() == pytest.approx([0, 0], abs=1e-4)
    # A step of 0.2 m has third differences of 0.2, -0.4, 0.2.
    assert values["seam_jerk"].tolist() == pytest.approx([0, 0.4 * 30**3], rel=1e-4, abs=1)
    assert values["floor_gap"].tolist() == pytest.approx([0, 20], abs=1e-4)
    assert values["frozen_share"].tolist() == [1, 1]
    assert values["foot_skating"][0] == pytest.approx(0, abs=1e-4)
    assert math.isnan(values["foot_skating"][1])


def test_results_leave_the_first_action_out_but_for_curves():
    recognized = [[True, True, False], [False, True, True]]
    acts = [
        Act(sequence, index, HIGH if hit else LOW, rise(6, 0.5), rise(12 + index, 0.5))
        for sequence, row in enumerate(recognized)
        for index, hit in enumerate(row)
    ]
    result = summarized(judge_acts(acts, judge(), longest=60), torch.randn(5, 3))
    assert result.figures["accuracy"].value == pytest.approx(3 / 4)
    assert result.figures["motion_qr"].value == pytest.approx(1 / 2)
    assert result.parts == 4
    assert result.curves["accuracy"] == [0.5, 1.0, 0.5]
    assert result.curves["action_qr"] == pytest.approx([0.5, 0.75, 4 / 6])
    assert result.curves["motion_qr"] == [0.5, 0.5, 0.0]
    (row,) = long_rows({"mine": result})
    assert row["system"] == "mine"
    assert row["accuracy"].startswith("0.750 [0.5")
    assert row["N"] == "4"
    rows = long_training_rows({"a": result, "b": result}, {"both": ["a", "b"]})
    assert rows[0]["accuracy"] == "0.750 ± 0.000"
    assert next(row["figure"] for row in curve_rows({"a": result})) == "accuracy"
    assert long_scalars({"mine-s0, pure": result})["mine-s0/pure/motion_qr"] == 0.5
    assert to_json(result)["figures"]["fid"]["low"] is None
