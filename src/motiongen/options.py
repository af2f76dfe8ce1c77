"""Annotations for options that have a range; the configuration check reads them without importing the plugin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True)
class Range:
    """Closed interval that an option's value must lie in."""

    least: float
    most: float = float("inf")


PositiveInt = Annotated[int, Range(1)]
NonNegativeFloat = Annotated[float, Range(0.0)]
PositiveFloat = Annotated[float, Range(1e-30)]
Share = Annotated[float, Range(0.0, 1.0)]
"""A probability or a fraction of a whole, 0 to 1."""
