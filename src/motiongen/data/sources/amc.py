"""Acclaim motion capture (AMC) files: degrees of freedom of named bones, frame by frame, degrees."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from motiongen.data.roots import DataError
from motiongen.data.sources.files import LARGEST_VALUE, is_finite, read_text

FRAME = re.compile("[0-9]{1,12}")


def read_amc(path: Path, widths: Mapping[str, int]) -> dict[str, Tensor]:
    """The values (T, n) float64 of the bones in `widths`, in the order in which the file's skeleton lists them.

    Args:
        path: a fully specified file in degrees.
        widths: for each bone that is wanted, its number of values; other bones are passed over.

    Raises:
        DataError: a frame is out of order, lacks a bone, or has another number of values or values that are not finite
            numbers; the message names the file, the line and the bone.
    """
    rows: dict[str, list[str]] = {bone: [] for bone in widths}
    places: dict[str, list[int]] = {bone: [] for bone in widths}
    frames = 0
    lines = read_text(path).splitlines()
    for number, line in enumerate(lines, start=1):
        bone, _, values = line.strip().partition(" ")
        if bone in rows:
            rows[bone].append(values)
            places[bone].append(number)
        elif FRAME.fullmatch(bone) and not values:
            _check_complete(path, number, rows, frames)
            frames += 1
            if int(bone) != frames:
                raise DataError(f"{path}:{number}: frame {bone} follows frame {frames - 1}")
    _check_complete(path, len(lines), rows, frames)
    if not frames:
        raise DataError(f"{path}: no frames")
    return {bone: _table(path, bone, rows[bone], places[bone], width) for bone, width in widths.items()}


def _check_complete(path: Path, number: int, rows: Mapping[str, list[str]], frames: int) -> None:
    for bone, values in rows.items():
        if len(values) != frames:
            what = "missing in" if len(values) < frames else "given twice in, or before,"
            raise DataError(f"{path}:{number}: {bone}: {what} frame {frames}; is the file damaged or cut?")


def _table(path: Path, bone: str, rows: list[str], places: list[int], width: int) -> Tensor:
    try:
        values = np.loadtxt(rows, ndmin=2, comments=None)
    except ValueError:
        values = np.empty((0, 0))
    if values.shape == (len(rows), width) and (np.abs(values) <= LARGEST_VALUE).all():
        return torch.from_numpy(values)
    for number, row in zip(places, rows, strict=True):
        words = row.split()
        if len(words) != width:
            raise DataError(f"{path}:{number}: {bone}: {len(words)} values, not {width}; is the file cut?")
        for word in words:
            if not is_finite(word):
                raise DataError(f"{path}:{number}: {bone}: {word!r:.40} is no finite number")
    raise DataError(f"{path}:{places[0]}: {bone}: values cannot be read as numbers")
