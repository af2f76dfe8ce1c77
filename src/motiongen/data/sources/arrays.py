"""Files of arrays, from anyone: NPZ, pickles and joblib files without anything that could run."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from motiongen.arrays import read_npz
from motiongen.data.roots import DataError
from motiongen.data.sources.files import LARGEST_VALUE, required
from motiongen.unpickling import RefusedPickle, read_pickle


def read_arrays(path: Path, names: Collection[str] | None = None) -> dict[str, Any]:
    """The arrays of an NPZ file, or those among `names`.

    Raises:
        DataError: the file is missing, damaged, or one of these arrays holds Python objects or is too large.
    """
    required(path)
    try:
        return read_npz(path, names)
    except ValueError as error:
        raise DataError(f"{path}: not an NPZ file of plain arrays: {error}") from error


def read_plain_pickle(path: Path) -> Any:
    """The content of a pickle or joblib file: arrays and builtin containers.

    Raises:
        DataError: the file is missing, damaged, or holds anything else.
    """
    try:
        return read_pickle(required(path))
    except RefusedPickle as error:
        raise DataError(str(error)) from error


def per_frame(where: object, content: Mapping[str, Any], field: str, width: int) -> Tensor:
    """A field with a row for every frame: (T, width) float64; further columns are left out.

    Args:
        where: the file, or the place in it, to name in errors.
        content: fields by name.
        field: the one that is wanted.
        width: how many numbers of a frame are wanted.

    Raises:
        DataError: the field is missing, of another shape or kind, or not finite.
    """
    if field not in content:
        raise DataError(f"{where}: field {field!r} is missing")
    array = content[field]
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu":
        raise DataError(f"{where}: field {field!r} is not an array of numbers")
    if array.ndim != 2 or array.shape[1] < width or not len(array):
        raise DataError(f"{where}: field {field!r} has shape {array.shape}, not (frames, {width})")
    table = torch.from_numpy(array[:, :width].astype(np.float64))
    wrong = ~(table.abs() <= LARGEST_VALUE).all(dim=1)  # NaN compares false
    if wrong.any():
        frame = int(wrong.nonzero()[0])
        what = f"beyond {LARGEST_VALUE:g}" if table[frame].isfinite().all() else "not finite"
        raise DataError(f"{where}: field {field!r} is {what} at frame {frame}")
    return table
