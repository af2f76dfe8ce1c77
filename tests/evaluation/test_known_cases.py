from __future__ import annotations

import pytest
import torch

from motiongen.contracts import MotionBatch
from motiongen.data.datamodule import MotionData
from motiongen.evaluation.evaluator import evaluate
from motiongen.evaluation.known_cases import SKATING, known_cases, real_against_real, reversed_in_time, shuffled
from motiongen.evaluation.protocol import Protocol
from motiongen.evaluation.table import reaction_rows
from motiongen.motion.representation import TRANSLATION
from motiongen.recognition.recognizer import TrainedRecognizer
from motiongen.recognition.transformer import TransformerRecognizer
from tests.recognition.corpus import three_actions


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> MotionData:
    return three_actions(tmp_path_factory.mktemp("data"))


@pytest.fixture
def batch(data: MotionData) -> MotionBatch:
    return next(iter(data.test_batches(8)))


def test_every_fault_shows_in_the_figures_that_are_for_it(data: MotionData) -> None:
    with torch.random.fork_rng():
        torch.manual_seed(0)
        network = TransformerRecognizer(tags=3, skeleton=data.skeleton, width=16, heads=2, layers=1, feature_width=4)
    recognizer = TrainedRecognizer(network, 0.5, "f" * 64, data.fingerprint, was_trained=False)
    protocol = Protocol(seeds=2, batch_size=4)
    (found,) = evaluate(known_cases(list(data.test_batches(4))), data, [recognizer], protocol)
    marked = {row["metric"]: {case for case, cell in row.items() if "↑" in cell} for row in reaction_rows(found)}
    assert "skating" in marked["foot skating (cm/frame)"]
    assert "frozen" not in marked["foot skating (cm/frame)"]
    assert "frozen" in marked["share of the time frozen"]
    assert "jitter" in marked["mean jerk (m/s³)"]
    assert "reversed" in marked["joint position error (cm)"]
    assert all("the same" not in cases for cases in marked.values())
    slid = found.systems["skating"].values["joint_position_error"][0]
    assert 0 < slid < 100 * SKATING


def test_reversing_twice_changes_nothing(batch: MotionBatch) -> None:
    draws = torch.Generator()
    once = MotionBatch(reversed_in_time(batch, draws), batch.condition)
    valid = batch.condition.mask
    assert torch.equal(reversed_in_time(once, draws)[valid], batch.motion[valid])
    last = int(batch.condition.lengths[0]) - 1
    assert torch.equal(once.motion[0, 0, TRANSLATION], batch.motion[0, last, TRANSLATION])


def test_shuffling_keeps_the_clips_of_every_length(batch: MotionBatch) -> None:
    found = shuffled(batch, torch.Generator().manual_seed(0))
    assert sorted(found.sum(dim=(1, 2)).tolist()) == pytest.approx(sorted(batch.motion.sum(dim=(1, 2)).tolist()))


def test_the_bias_of_fid_shrinks_with_the_number_of_clips_and_extrapolates_to_nothing() -> None:
    features = torch.randn(2000, 4, generator=torch.Generator().manual_seed(0))
    rows = real_against_real(features, (50, 200, 5000), draws=10, seed=0)
    assert [row["N"] for row in rows] == ["50", "200", "1000"]
    fids = [float(row["FID"].split()[0]) for row in rows]
    assert fids[0] > 2 * fids[1] > 4 * fids[2]
    assert abs(float(rows[-1]["extrapolated FID"].split()[0])) < fids[-1]
