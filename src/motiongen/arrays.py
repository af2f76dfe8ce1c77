"""NPZ files of unknown origin."""

from __future__ import annotations

import zipfile
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

LARGEST = 2**31
"""Bytes of an array; SMPL-X's largest, its shape directions, has a tenth of it."""


def read_npz(path: Path, names: Collection[str] | None = None) -> dict[str, NDArray[Any]]:
    """The plain arrays of a file, without running what it contains or believing the sizes that it claims.

    Args:
        path: the file.
        names: which arrays are wanted; all by default. Those that are not there are left out.

    Raises:
        ValueError: not an NPZ file, damaged, or with an array that is larger than LARGEST or of another size than it
            claims.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            wanted = members.keys() if names is None else members.keys() & set(names)
            return {name: _array(archive, members[name]) for name in sorted(wanted)}
    except Exception as error:
        # Damaged headers are evaluated as literals, and decompressors have errors of their own: it can be nearly any.
        raise ValueError(f"{type(error).__name__}: {error}") from error


def _array(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> NDArray[Any]:
    if info.file_size > LARGEST:
        raise ValueError(f"{info.filename} has {info.file_size} bytes, more than {LARGEST}")
    with archive.open(info) as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = read(file)
        size = dtype.itemsize * int(np.prod(shape, dtype=object))
        if dtype.hasobject or size != info.file_size - file.tell():
            raise ValueError(f"{info.filename} claims {shape} of {dtype} in {info.file_size} bytes")
    with archive.open(info) as file:
        array: NDArray[Any] = np.lib.format.read_array(file, allow_pickle=False)
    return array
