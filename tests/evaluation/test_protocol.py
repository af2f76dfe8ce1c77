from __future__ import annotations

import json

import pytest
import torch
from torch import Tensor

from motiongen.contracts import Condition
from motiongen.data.datamodule import MotionData
from motiongen.evaluation.protocol import Generate, Protocol, evaluate
from motiongen.evaluation.results import REAL
from motiongen.evaluation.table import FURTHER, HEADINGS, action_rows, footnote, further_rows, markdown, metric_rows
from motiongen.motion.representation import TRANSLATION
from motiongen.recognition.recognizer import TrainedRecognizer
from motiongen.recognition.transformer import TransformerRecognizer
from tests.recognition.corpus import three_actions

PROTOCOL = Protocol(seeds=3, batch_size=4)


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> MotionData:
    return three_actions(tmp_path_factory.mktemp("data"))


@pytest.fixture(scope="module")
def recognizer(data: MotionData) -> TrainedRecognizer:
    with torch.random.fork_rng():
        torch.manual_seed(0)
        network = TransformerRecognizer(tags=3, skeleton=data.skeleton, width=16, heads=2, layers=1, feature_width=8)
    return TrainedRecognizer(network, test_accuracy=0.5, fingerprint="f" * 64, was_trained=False)


def replay(data: MotionData) -> Generate:
    """A generator that knows the real motion by its initial frames and length."""
    batches = list(data.test_batches(PROTOCOL.batch_size))

    def generate(condition: Condition, seed: int) -> Tensor:
        return next(
            batch.motion for batch in batches if batch.condition is condition or same(batch.condition, condition)
        )

    def same(first: Condition, second: Condition) -> bool:
        pairs = [(first.mask, second.mask), (first.tags, second.tags), (first.trajectory, second.trajectory)]
        return all(one.shape == two.shape and torch.equal(one, two) for one, two in pairs)

    return generate


def frozen(condition: Condition, seed: int) -> Tensor:
    return condition.initial_motion[:, -1:].expand(-1, condition.mask.shape[1], -1)


def noisy(condition: Condition, seed: int) -> Tensor:
    noise = torch.randn(*condition.mask.shape, 135, generator=torch.Generator().manual_seed(seed))
    return frozen(condition, seed) + 0.1 * noise


def test_the_real_motion_scores_as_real_motion(data: MotionData, recognizer: TrainedRecognizer) -> None:
    found = evaluate({"replay": replay(data)}, data, recognizer, PROTOCOL)
    real, replayed = found.systems[REAL], found.systems["replay"]
    assert replayed.values["trajectory_error"] == (0.0, 0.0, 0.0)
    assert replayed.values["joint_position_error"] == (0.0, 0.0, 0.0)
    assert replayed.values["fid"] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    for metric in (
        "accuracy",
        "diversity",
        "multimodality",
        "joint_speed",
        "foot_skating",
        "peak_jerk",
        "frozen_share",
    ):
        assert replayed.values[metric] == real.values[metric]
    # Six clips against themselves, every one on its own place in feature space.
    assert [replayed.values[name][0] for name in ("precision", "recall", "coverage")] == [1.0, 1.0, 1.0]
    assert replayed.values["nearest_training_distance"] == real.values["nearest_training_distance"]
    assert replayed.estimate("accuracy").interval == 0.0
    assert found.off_speed("replay") == ()
    assert found.count == len(data.test_items()) == 6


def test_frozen_motion_is_flagged(data: MotionData, recognizer: TrainedRecognizer) -> None:
    found = evaluate({"frozen": frozen}, data, recognizer, PROTOCOL)
    assert set(found.off_speed("frozen")) == {"stand", "walk", "wave"}
    system = found.systems["frozen"]
    assert all(action.speed_ratio == pytest.approx(0.0, abs=1e-6) for action in system.actions.values())
    assert system.values["fid"][0] > 0
    assert system.values["frozen_share"] == (1.0, 1.0, 1.0)
    assert system.values["peak_jerk"] == pytest.approx((0.0, 0.0, 0.0), abs=1e-2)
    # Only walking has a trajectory, so standing still misses by half of what was walked, on average.
    walks = [batch for batch in data.test_batches(1) if batch.condition.tags[0, 1]]
    missed = [batch.motion[0, :, TRANSLATION][:, :2].norm(dim=-1).mean() for batch in walks]
    assert system.values["trajectory_error"][0] == pytest.approx(float(sum(missed) / len(missed)), rel=1e-6)


def test_every_batch_and_seed_has_its_own_noise_and_the_whole_is_repeatable(
    data: MotionData, recognizer: TrainedRecognizer
) -> None:
    seeds: list[int] = []

    def remembering(condition: Condition, seed: int) -> Tensor:
        seeds.append(seed)
        return noisy(condition, seed)

    first = evaluate({"noisy": remembering}, data, recognizer, PROTOCOL)
    assert len(set(seeds)) == len(seeds) == 3 * 2
    assert first.systems["noisy"].estimate("fid").interval > 0
    assert evaluate({"noisy": noisy}, data, recognizer, PROTOCOL).to_json() == first.to_json()


def test_padded_frames_never_enter(data: MotionData, recognizer: TrainedRecognizer) -> None:
    def spoiled(condition: Condition, seed: int) -> Tensor:
        return noisy(condition, seed).masked_fill(~condition.mask.unsqueeze(-1), float("nan"))

    clean = evaluate({"system": noisy}, data, recognizer, PROTOCOL)
    assert evaluate({"system": spoiled}, data, recognizer, PROTOCOL).to_json() == clean.to_json()


def test_what_cannot_be_judged_is_named(data: MotionData, recognizer: TrainedRecognizer) -> None:
    with pytest.raises(ValueError, match=r"system broken, seed 0: .* not finite"):
        evaluate({"broken": lambda condition, seed: frozen(condition, seed) * float("nan")}, data, recognizer, PROTOCOL)
    with pytest.raises(ValueError, match=r"system short, seed 0: .* shape"):
        evaluate({"short": lambda condition, seed: frozen(condition, seed)[:, 1:]}, data, recognizer, PROTOCOL)
    with pytest.raises(ValueError, match='"real" is kept'):
        evaluate({REAL: frozen}, data, recognizer, PROTOCOL)


def test_the_results_can_be_written_logged_and_printed(data: MotionData, recognizer: TrainedRecognizer) -> None:
    found = evaluate({"generated": noisy, "frozen": frozen}, data, recognizer, PROTOCOL)
    summary = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert list(summary["systems"]) == ["real", "generated", "frozen"]
    assert summary["seeds"] == [0, 1, 2]
    assert summary["count"] == 6
    assert summary["recognizer"] == {"fingerprint": "f" * 64, "test_accuracy": 0.5}
    fid = summary["systems"]["generated"]["metrics"]["fid"]
    assert sum(fid["values"]) / 3 == pytest.approx(fid["mean"])
    assert found.scalars()["generated/fid"] == fid["mean"]
    assert found.scalars()["generated/fid_interval"] == fid["interval"]
    rows = metric_rows(found)
    assert [row["system"] for row in rows] == ["real", "generated", "frozen"]
    assert all(row["N"] == "6" for row in rows)
    assert rows[1]["FID"] == f"{fid['mean']:.3f} ± {fid['interval']:.3f}"
    assert [row["speed check"] for row in action_rows(found, "frozen")] == ["off", "off", "off"]
    assert markdown(rows).count("\n") == 4
    shown = {row["metric"]: row["frozen"] for row in further_rows(found)}
    assert shown["share of the time frozen"] == "1.000 ± 0.000"
    assert set(HEADINGS) | set(FURTHER) == set(found.systems["frozen"].values)
    assert "6 test clips" in footnote(found)
