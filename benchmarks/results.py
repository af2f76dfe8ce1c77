"""What a row finds, and the check that the fast way gives what the plain way gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from benchmarks.measuring import Timing


class InexactError(Exception):
    """A fast way whose result is not that of the plain way."""


@dataclass(frozen=True)
class Comparison:
    """Plain reference code and ours, called in turn."""

    name: str
    reference: Timing
    ours: Timing
    error: float
    """How far ours is from the reference, relative to it."""
    tolerance: float
    target: float | None = None
    """How many times faster ours should be."""
    floor: float | None = None
    """Seconds of the matrix products alone, at the rate of the machine."""
    made: tuple[float, str] | None = None
    """How many of what one call makes."""
    target_rate: float | None = None
    """How many of them a second there should be."""

    def __post_init__(self) -> None:
        if not self.error <= self.tolerance:
            raise InexactError(f"{self.name}: off by {self.error:.1e}, more than {self.tolerance:.0e}")

    @property
    def ratio(self) -> Timing:
        return self.reference.over(self.ours)

    def metrics(self) -> Mapping[str, float]:
        found = {
            "ratio": self.ratio.median,
            "ours_seconds": self.ours.median,
            "reference_seconds": self.reference.median,
            "error": self.error,
        }
        if self.floor is not None:
            found["floor_seconds"] = self.floor
        if self.made is not None:
            found["a_second"] = self.made[0] / self.ours.median
        return found


@dataclass(frozen=True)
class Figure:
    """One number, measured without a reference."""

    name: str
    value: float
    unit: str = ""
    target: str = ""

    def metrics(self) -> Mapping[str, float]:
        return {"value": self.value}


Result = Comparison | Figure


def relative_error(found: Tensor, expected: Tensor) -> float:
    """|found - expected| / |expected|, in the Euclidean norm."""
    found, expected = found.detach().double(), expected.detach().double()
    return float((found - expected).norm() / expected.norm().clamp(min=torch.finfo(torch.float32).tiny))
