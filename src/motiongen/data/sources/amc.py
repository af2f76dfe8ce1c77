"""Acclaim motion capture (AMC) files: degrees of freedom of named bones, frame by frame, degrees."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from motiongen.data.roots import DataError


def read_amc(path: Path, widths: Mapping[str, int]) -> dict[str, Tensor]:
    """The values (T, n) float64 of the bones in `widths`, in the order in which the file's skeleton lists them.

    Args:
        path: a fully specified file in degrees.
        widths: for each bone that is wanted, its number of values; other bones are passed over.

    Raises:
        DataError: a frame is out of order, lacks a bone, or has another number of values or values that are not finite
            numbers; the message names the file, the line and the bone.
    """
    frames: list[dict[str, list[float]]] = []
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words or words[0][0] in "#:":
            continue
        if len(words) == 1 and words[0].isdigit():
            _check_complete(path, number, frames, widths)
            if int(words[0]) != len(frames) + 1:
                raise DataError(f"{path}:{number}: frame {words[0]} follows frame {len(frames)}")
            frames.append({})
        elif not frames:
            raise DataError(f"{path}:{number}: {words[0]!r} before the first frame's number")
        elif words[0] in widths:
            frames[-1][words[0]] = _values(path, number, words, widths[words[0]])
    _check_complete(path, len(lines), frames, widths)
    if not frames:
        raise DataError(f"{path}: no frames")
    return {bone: _table(path, bone, [frame[bone] for frame in frames], width) for bone, width in widths.items()}


def _values(path: Path, number: int, words: list[str], width: int) -> list[float]:
    try:
        values = [float(word) for word in words[1:]]
    except ValueError as error:
        raise DataError(f"{path}:{number}: {words[0]}: {error}") from None
    if len(values) != width:
        raise DataError(f"{path}:{number}: {words[0]}: {len(values)} values, not {width}; is the file cut?")
    return values


def _check_complete(path: Path, number: int, frames: list[dict[str, list[float]]], widths: Mapping[str, int]) -> None:
    if frames and len(frames[-1]) < len(widths):
        missing = next(bone for bone in widths if bone not in frames[-1])
        raise DataError(f"{path}:{number}: {missing}: missing in frame {len(frames)}; is the file cut?")


def _table(path: Path, bone: str, rows: list[list[float]], width: int) -> Tensor:
    values = np.array(rows).reshape(len(rows), width)
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        raise DataError(f"{path}: {bone}: a value of frame {int(np.argmin(finite)) + 1} is not finite")
    return torch.from_numpy(values)
