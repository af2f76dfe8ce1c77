"""Distances between all rows of two sets of features, a block at a time, so that large sets fit into memory."""

from __future__ import annotations

from collections.abc import Iterator

import torch
from torch import Tensor

BLOCK = 2**22
"""Distances that are held at once; 32 MB in float64."""


def require_sets(metric: str, first: Tensor, second: Tensor, least: int) -> None:
    """Refuse sets of features that cannot be compared.

    Raises:
        ValueError: sets that are not (N, E) and (M, E) with N and M at least `least`.
    """
    if min(len(first), len(second)) < least or first.shape[1:] != second.shape[1:] or first.ndim != 2:
        shapes = f"{tuple(first.shape)} and {tuple(second.shape)}"
        raise ValueError(f"{metric} compares two sets of at least {least} samples and of equal width, not {shapes}")


def row_blocks(first: Tensor, second: Tensor) -> tuple[Tensor, ...]:
    """Cut first (N, E) into (n, E), each with at most BLOCK pairs of its rows with those of second (M, E)."""
    return first.split(max(1, BLOCK // len(second)))


def distance_blocks(first: Tensor, second: Tensor, *, exact: bool) -> Iterator[Tensor]:
    """Euclidean distances from the rows of first (N, E), in order, to those of second (M, E): blocks (n, M) float64.

    `exact` takes the differences of coordinates: the same two rows have the same distance, to the last bit, in every
    call and either order. That is for distances that are compared with each other. Otherwise a matrix product is ten
    times as fast; it leaves between equal rows a distance of up to about 1e-8 of the sets' extent.
    """
    first, second = first.double(), second.double()
    if not exact:
        # The matrix product loses digits to a common offset.
        origin = second.mean(dim=0)
        first, second = first - origin, second - origin
    mode = "donot_use_mm_for_euclid_dist" if exact else "use_mm_for_euclid_dist"
    for rows in row_blocks(first, second):
        yield torch.cdist(rows, second, compute_mode=mode)
