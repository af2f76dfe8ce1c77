"""What sources that read files share."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from motiongen.data.roots import DataError


def digest(root: Path, paths: Iterable[Path], *settings: object) -> str:
    """SHA-256 hex of the files' names below `root`, their content, and settings that change what is made of them."""
    total = hashlib.sha256(repr(settings).encode())
    for path in sorted(paths):
        total.update(f"\0{path.relative_to(root).as_posix()}\0".encode())
        with path.open("rb") as file:
            total.update(hashlib.file_digest(file, "sha256").digest())
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
