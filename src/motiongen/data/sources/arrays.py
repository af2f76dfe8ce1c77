"""Files of arrays, from anyone: NPZ, pickles and joblib files without anything that could run."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from motiongen.data.roots import DataError
from motiongen.data.sources.files import required
from motiongen.unpickling import RefusedPickle, read_pickle


def read_arrays(path: Path, names: Iterable[str] | None = None) -> dict[str, Any]:
    """The arrays of an NPZ file, or those among `names`.

    Raises:
        DataError: the file is missing, damaged, or one of these arrays holds Python objects.
    """
    required(path)
    try:
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file.files if names is None or name in names}
    except (OSError, ValueError, TypeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
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
    if not table.isfinite().all():
        frame = int((~table.isfinite()).any(dim=1).nonzero()[0])
        raise DataError(f"{where}: field {field!r} is not finite at frame {frame}")
    return table
