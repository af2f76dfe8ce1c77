"""Schedules over the run, in fractions of it, so that a shorter run keeps its shape."""

from __future__ import annotations

from motiongen.errors import InputError
from motiongen.options import Share


# No dataclass: a configuration takes instances of those apart where they stand in a mapping, such as objective.ramps.
class LinearRamp:
    """0 until `start`, then linearly up to 1 at `end`; both in [0, 1].

    Raises:
        InputError: unless 0 <= start <= end <= 1.
    """

    def __init__(self, start: Share, end: Share) -> None:
        if not 0 <= start <= end <= 1:
            raise InputError(f"a ramp needs 0 <= start <= end <= 1, not start {start} and end {end}")
        self.start = start
        self.end = end

    def __call__(self, progress: float) -> float:
        if progress >= self.end:
            return 1.0
        return 0.0 if progress <= self.start else (progress - self.start) / (self.end - self.start)
