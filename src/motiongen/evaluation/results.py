"""What an evaluation found, ready to be printed, logged and written to summary.json."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from motiongen.evaluation.uncertainty import Interval

if TYPE_CHECKING:
    from motiongen.evaluation.lengths import LengthResult
    from motiongen.evaluation.protocol import Protocol

REAL = "real"
"""The name of the real test clips among the systems."""
MOSTLY = 0.9
"""A system that is frozen for a larger share of the time stands still."""


@dataclass(frozen=True)
class Estimate:
    """A mean over seeds with its 95% interval, mean +- interval."""

    mean: float
    interval: float
    """1.96 std / sqrt(n), std with n - 1; NaN for a single seed."""

    @classmethod
    def of(cls, values: tuple[float, ...]) -> Estimate:
        """The estimate from one value a seed."""
        count = len(values)
        mean = math.fsum(values) / count
        if count == 1:
            return cls(mean, math.nan)
        deviation = math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (count - 1))
        return cls(mean, 1.96 * deviation / math.sqrt(count))


@dataclass(frozen=True)
class ActionResult:
    """One system's clips of one tag, over all seeds. NaN where nothing could be measured."""

    count: int
    """Test clips with the tag."""
    accuracy: float
    joint_speed: float
    """Metres per second."""
    speed_ratio: float
    """Joint speed over that of the real clips: far below 1 is frozen, far above 1 jitters."""
    foot_skating: float
    """Centimetres per frame."""
    skating_ratio: float
    """Foot skating over that of the real clips."""


@dataclass(frozen=True)
class SystemResult:
    """What one system, or the real test clips, scored."""

    count: int
    """N: its clips."""
    values: dict[str, tuple[float, ...]]
    """Metric name to one value a seed."""
    actions: dict[str, ActionResult]
    """Tag to what its clips scored."""
    clips: dict[str, Interval]
    """Metric to its interval over test clips, of means over seeds; for the metrics that have one."""
    differences: dict[str, Interval]
    """Metric to its paired difference from the first system, this one minus that one, with its interval over clips."""
    lengths: tuple[LengthResult, ...] = ()
    """What it scored at the protocol's lengths, in their order."""

    def estimate(self, metric: str) -> Estimate:
        """Mean and 95% interval over seeds."""
        return Estimate.of(self.values[metric])


@dataclass(frozen=True)
class Evaluation:
    """Every figure of an evaluation with what is needed to judge it."""

    protocol: Protocol
    systems: dict[str, SystemResult]
    """The real test clips under REAL, then the systems in the order in which they were given."""
    count: int
    """N: test clips, and so the number of real motions in every FID of a system."""
    real_fid_count: int
    """Training clips that the real test clips' own FID was taken against: `count`, or all there are."""
    takes: int
    """The takes that the test clips were cut from; intervals over clips draw these."""
    data_fingerprint: str
    recognizer: str
    """The recognizer's family: the name of its class."""
    feature_width: int
    """E, the width of the features in which FID and its like are measured."""
    recognizer_fingerprint: str
    recognizer_accuracy: float

    def off_speed(self, system: str) -> tuple[str, ...]:
        """Tags whose mean joint speed differs from the real clips' by more than the protocol's tolerance."""
        tolerance, actions = self.protocol.speed_tolerance, self.systems[system].actions
        return tuple(tag for tag, action in actions.items() if abs(action.speed_ratio - 1) > tolerance)

    def warnings(self) -> tuple[str, ...]:
        """What a reader of the tables has to be told before believing them."""
        found = []
        fewest = min(self.real_fid_count, *(system.count for system in self.systems.values()))
        if fewest <= self.feature_width:
            found.append(
                f"N = {fewest} is not above the {self.feature_width} features: covariances are not of full rank, and "
                "FID is dominated by its bias; read KID instead"
            )
        for name, system in self.systems.items():
            if system.estimate("frozen_share").mean > MOSTLY:
                found.append(f"{name}: the motion stands still")
        return tuple(found)

    def scalars(self) -> dict[str, float]:
        """Flat names to numbers for a tracker: "generated/fid", "generated/fid_interval", ... Finite values only."""
        flat = {"recognizer/test_accuracy": self.recognizer_accuracy}
        for name, system in self.systems.items():
            for metric in system.values:
                estimate = system.estimate(metric)
                flat[f"{name}/{metric}"] = estimate.mean
                flat[f"{name}/{metric}_interval"] = estimate.interval
        return {name: value for name, value in flat.items() if math.isfinite(value)}

    def length_scalars(self) -> dict[int, dict[str, float]]:
        """Frames to flat names to means, "generated/accuracy_at_length": a tracker draws them over the frames."""
        flat: dict[int, dict[str, float]] = {frames: {} for frames in self.protocol.lengths}
        for name, system in self.systems.items():
            for length in system.lengths:
                means = {metric: Estimate.of(own).mean for metric, own in length.values.items()}
                flat[length.frames] |= {f"{name}/{metric}_at_length": mean for metric, mean in means.items()}
        return flat

    def to_json(self) -> dict[str, Any]:
        """Everything as plain values for summary.json; what could not be measured is None."""
        systems = {
            name: {
                "metrics": {
                    metric: {**asdict(system.estimate(metric)), "values": list(values)}
                    for metric, values in system.values.items()
                },
                "actions": {tag: asdict(action) for tag, action in system.actions.items()},
                "count": system.count,
                "off_speed": list(self.off_speed(name)),
                "over_clips": {metric: asdict(interval) for metric, interval in system.clips.items()},
                "differences": {metric: asdict(interval) for metric, interval in system.differences.items()},
            }
            | ({"lengths": [length.to_json() for length in system.lengths]} if system.lengths else {})
            for name, system in self.systems.items()
        }
        summary = {
            "protocol": self.protocol.to_json(),
            "seeds": list(self.protocol.generation_seeds),
            "count": self.count,
            "real_fid_count": self.real_fid_count,
            "takes": self.takes,
            "warnings": list(self.warnings()),
            "data_fingerprint": self.data_fingerprint,
            "recognizer": {
                "name": self.recognizer,
                "fingerprint": self.recognizer_fingerprint,
                "test_accuracy": self.recognizer_accuracy,
                "feature_width": self.feature_width,
            },
            "systems": systems,
        }
        plain: dict[str, Any] = _without_nan(summary)
        return plain


def _without_nan(value: Any) -> Any:
    """JSON knows no NaN."""
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
