from __future__ import annotations

import copy
import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch import Tensor

from motiongen.contracts import Condition
from motiongen.data.datamodule import MotionData
from motiongen.evaluation.archive import Archive
from motiongen.evaluation.evaluator import Generate, Recorded, System, evaluate
from motiongen.evaluation.leaks import LeakError
from motiongen.evaluation.protocol import Protocol
from motiongen.evaluation.results import REAL, Evaluation
from motiongen.evaluation.table import (
    FURTHER,
    HEADINGS,
    action_rows,
    difference_rows,
    disagreements,
    footnote,
    further_rows,
    interval_rows,
    markdown,
    metric_rows,
)
from motiongen.evaluation.uncertainty import Interval
from motiongen.motion.representation import TRANSLATION
from motiongen.recognition.gru import GRURecognizer
from motiongen.recognition.recognizer import TrainedRecognizer

PROTOCOL = Protocol(seeds=3, batch_size=4)


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


def judged(
    data: MotionData, recognizer: TrainedRecognizer, protocol: Protocol = PROTOCOL, **systems: Generate
) -> Evaluation:
    named = {name: System(generate) for name, generate in systems.items()}
    return evaluate(named, data, [recognizer], protocol)[0]


def frozen(condition: Condition, seed: int) -> Tensor:
    return condition.initial_motion[:, -1:].expand(-1, condition.mask.shape[1], -1)


def noisy(condition: Condition, seed: int) -> Tensor:
    noise = torch.randn(*condition.mask.shape, 135, generator=torch.Generator().manual_seed(seed))
    return frozen(condition, seed) + 0.1 * noise


def test_the_real_motion_scores_as_real_motion(data: MotionData, recognizer: TrainedRecognizer) -> None:
    found = judged(data, recognizer, replay=replay(data))
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
    found = judged(data, recognizer, frozen=frozen)
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

    first = judged(data, recognizer, noisy=remembering)
    assert len(set(seeds)) == len(seeds) == 3 * 2
    assert first.systems["noisy"].estimate("fid").interval > 0
    assert judged(data, recognizer, noisy=noisy).to_json() == first.to_json()


def test_padded_frames_never_enter(data: MotionData, recognizer: TrainedRecognizer) -> None:
    def spoiled(condition: Condition, seed: int) -> Tensor:
        return noisy(condition, seed).masked_fill(~condition.mask.unsqueeze(-1), float("nan"))

    clean = judged(data, recognizer, system=noisy)
    assert judged(data, recognizer, system=spoiled).to_json() == clean.to_json()


def test_what_cannot_be_judged_is_named(data: MotionData, recognizer: TrainedRecognizer) -> None:
    with pytest.raises(ValueError, match=r"system broken, seed 0: .* not finite"):
        judged(data, recognizer, broken=lambda condition, seed: frozen(condition, seed) * float("nan"))
    with pytest.raises(ValueError, match=r"system short, seed 0: .* shape"):
        judged(data, recognizer, short=lambda condition, seed: frozen(condition, seed)[:, 1:])
    with pytest.raises(ValueError, match='"real" is kept'):
        judged(data, recognizer, **{REAL: frozen})


def test_the_results_can_be_written_logged_and_printed(data: MotionData, recognizer: TrainedRecognizer) -> None:
    found = judged(data, recognizer, generated=noisy, frozen=frozen)
    summary = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert list(summary["systems"]) == ["real", "generated", "frozen"]
    assert summary["seeds"] == [0, 1, 2]
    assert summary["count"] == 6
    assert summary["recognizer"]["fingerprint"] == "f" * 64
    assert summary["recognizer"]["test_accuracy"] == 0.5
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


def test_seeds_that_were_judged_are_not_generated_again(
    data: MotionData, recognizer: TrainedRecognizer, tmp_path: Path
) -> None:
    numbers: list[int] = []

    def remembering(condition: Condition, seed: int) -> Tensor:
        numbers.append(seed)
        return noisy(condition, seed)

    archive, system = Archive(tmp_path), {"noisy": System(remembering, "weights and settings")}
    evaluate(system, data, [recognizer], PROTOCOL, archive)
    assert len(numbers) == 3 * 2
    (more,) = evaluate(system, data, [recognizer], replace(PROTOCOL, seeds=5), archive)
    assert numbers[6:] == [6, 7, 8, 9]
    assert more.to_json() == judged(data, recognizer, replace(PROTOCOL, seeds=5), noisy=noisy).to_json()
    # A file that is damaged is made anew; another system, or one without a fingerprint, finds nothing.
    next(tmp_path.iterdir()).write_bytes(b"cut")
    evaluate(system, data, [recognizer], replace(PROTOCOL, seeds=5), archive)
    assert len(numbers) == 6 + 4 + 2
    evaluate({"noisy": System(remembering, "others")}, data, [recognizer], PROTOCOL, archive)
    evaluate({"noisy": System(remembering)}, data, [recognizer], PROTOCOL, archive)
    assert len(numbers) == 12 + 6 + 6


def test_two_recognizers_judge_the_same_motions(data: MotionData, recognizer: TrainedRecognizer) -> None:
    calls: list[int] = []

    def remembering(condition: Condition, seed: int) -> Tensor:
        calls.append(seed)
        return noisy(condition, seed)

    with torch.random.fork_rng():
        torch.manual_seed(1)
        network = GRURecognizer(tags=3, skeleton=data.skeleton, width=16, layers=1)
    second = TrainedRecognizer(network, 0.5, "e" * 64, data.fingerprint, was_trained=False)
    one, other = evaluate({"noisy": System(remembering)}, data, [recognizer, second], PROTOCOL)
    assert len(calls) == 3 * 2
    assert one.systems["noisy"].values["fid"] != other.systems["noisy"].values["fid"]
    assert one.systems["noisy"].values["foot_skating"] == other.systems["noisy"].values["foot_skating"]
    assert (one.recognizer, other.recognizer) == ("TransformerRecognizer", "GRURecognizer")


def test_a_recognizer_of_another_split_is_refused(data: MotionData, recognizer: TrainedRecognizer) -> None:
    with pytest.raises(LeakError, match="it may know the test clips"):
        judged(data, replace(recognizer, data_fingerprint="another"), noisy=noisy)


def test_an_action_without_a_test_clip_is_refused(data: MotionData, recognizer: TrainedRecognizer) -> None:
    lacking = copy.copy(data)
    absent = data.tags[0]
    segments = [data.store.sequences[clip.sequence].segments[clip.segment] for clip in data.split.test]
    others = tuple(clip for clip, one in zip(data.split.test, segments, strict=True) if absent not in one.tags)
    lacking.split = replace(data.split, test=others)
    with pytest.raises(ValueError, match=f"no test clip shows {absent}; its figures would mean nothing"):
        judged(lacking, replace(recognizer, data_fingerprint=lacking.fingerprint), noisy=noisy)


def test_intervals_and_differences_are_over_the_clips(data: MotionData, recognizer: TrainedRecognizer) -> None:
    found = judged(data, recognizer, noisy=noisy, again=noisy, frozen=frozen)
    system = found.systems["noisy"]
    for metric in ("accuracy", "fid", "joint_position_error", "foot_skating"):
        interval = system.clips[metric]
        assert interval.value == pytest.approx(system.estimate(metric).mean, nan_ok=True)
        assert not interval.low > interval.value > interval.high
    same = found.systems["again"].differences
    assert all(interval == Interval(0.0, 0.0, 0.0) for interval in same.values())
    error = found.systems["frozen"].differences["joint_position_error"]
    expected = (
        found.systems["frozen"].estimate("joint_position_error").mean - system.clips["joint_position_error"].value
    )
    assert error.value == pytest.approx(expected)
    assert not system.differences
    assert "frozen: the motion stands still" in found.warnings()
    assert any("covariances are not of full rank" in text for text in found.warnings())
    assert [row["metric"] for row in difference_rows(found)][:2] == ["accuracy", "FID"]
    assert {"real", "noisy", "again", "frozen"} < set(interval_rows(found)[0])


def test_recognizers_that_disagree_are_named(data: MotionData, recognizer: TrainedRecognizer) -> None:
    found = judged(data, recognizer, noisy=noisy, frozen=frozen)
    assert disagreements(found, found) == []
    swapped = dict(zip(found.systems, [found.systems[name] for name in ("real", "frozen", "noisy")], strict=True))
    other = replace(found, systems=swapped, recognizer="Other")
    assert any(text.startswith("FID of noisy and frozen: ") for text in disagreements(found, other))


def test_recorded_motion_is_measured_without_a_counterpart(data: MotionData, recognizer: TrainedRecognizer) -> None:
    """Test clips as recorded motion score what they score as a system, where no counterpart is asked for."""
    batches = list(data.test_batches(4))
    systems = {"recorded": Recorded(batches), "replay": System(replay(data)), "half": Recorded(batches[:1])}
    (found,) = evaluate(systems, data, [recognizer], PROTOCOL)
    recorded, replayed, half = (found.systems[name] for name in systems)
    for metric, values in replayed.values.items():
        if metric not in ("trajectory_error", "joint_position_error"):
            assert recorded.values[metric] == pytest.approx(values, abs=1e-9, nan_ok=True), metric
    assert math.isnan(recorded.estimate("joint_position_error").mean)
    assert recorded.differences == half.differences == {}
    assert (recorded.count, half.count) == (6, 4)
    assert metric_rows(found)[3]["N"] == "4"
    json.dumps(found.to_json(), allow_nan=False)
