"""What sources that read files share."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from torch import Tensor

from motiongen.data.roots import DataError
from motiongen.motion.resampling import resample

FPS = 30.0


def digest(root: Path, paths: Iterable[Path], *settings: object) -> str:
    """SHA-256 hex of the files' names below `root`, their content, and settings that change what is made of them."""
    total = hashlib.sha256(repr(settings).encode())
    for path in sorted(paths):
        total.update(b"\0" + os.fsencode(path.relative_to(root).as_posix()) + b"\0")
        total.update(hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()


def required(path: Path) -> Path:
    """The path of a file that must be there.

    Raises:
        DataError: it is not.
    """
    if not path.is_file():
        raise DataError(f"{path}: the file is missing from the data set")
    return path


def read_json(path: Path) -> Any:
    """A JSON file's content.

    Raises:
        DataError: the file is missing or not JSON.
    """
    content = required(path).read_bytes()
    try:
        return json.loads(content)
    except ValueError as error:
        raise DataError(f"{path}: not a JSON file: {error}") from error


def is_finite(word: str) -> bool:
    """Whether a word of a text file is a finite number."""
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False


def at_thirty(local: Tensor, pelvis: Tensor, rate: float) -> tuple[Tensor, Tensor]:
    """Local rotations (T, 22, 3, 3) and pelvis positions (T, 3) of any rate at 30 Hz."""
    # A rate that was rounded in the file, 30.00003 or 119.9995, would cost the last frame.
    rate = round(rate) if abs(rate - round(rate)) < 0.01 else rate
    return (local, pelvis) if rate == FPS else resample(local, pelvis, rate, FPS)
