"""What sources that read files share."""

from __future__ import annotations

import csv
import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

from motiongen.data.roots import DataError
from motiongen.files import is_file

LARGEST_FILE = 2**30
"""Bytes of a file that is read as a whole."""
LARGEST_JSON = 2**28
"""Bytes of a JSON file, whose content takes some ten times as much; BABEL's largest has a fifth of it."""
LARGEST_VALUE = 1e7
"""Degrees or units of length; beyond it, a file is damaged."""


def digest(root: Path, paths: Iterable[Path], *settings: object) -> str:
    """SHA-256 hex of the files' names below `root`, their content, and settings that change what is made of them."""
    total = hashlib.sha256(repr(settings).encode())
    for path in sorted(paths):
        total.update(b"\0" + os.fsencode(path.relative_to(root).as_posix()) + b"\0")
        with path.open("rb") as file:
            total.update(hashlib.file_digest(file, "sha256").digest())
    return total.hexdigest()


def required(path: Path) -> Path:
    """The path of a file that must be there.

    Raises:
        DataError: it is not.
    """
    if not is_file(path):
        raise DataError(f"{path}: the file is missing from the data set")
    return path


def read_json(path: Path) -> Any:
    """A JSON file's content.

    Raises:
        DataError: the file is missing, too large or not JSON.
    """
    try:
        return json.loads(read_text(path, errors="strict", largest=LARGEST_JSON))
    except (ValueError, RecursionError) as error:
        raise error if isinstance(error, DataError) else DataError(f"{path}: not a JSON file: {error}") from error


def read_text(path: Path, errors: Literal["strict", "replace"] = "replace", largest: int = LARGEST_FILE) -> str:
    """A file's text, UTF-8.

    Raises:
        DataError: the file is missing, unreadable or too large, or not UTF-8 where errors are not replaced.
    """
    try:
        if required(path).stat().st_size > largest:
            raise DataError(f"{path}: larger than {largest} bytes")
        return path.read_text(encoding="utf-8", errors=errors)
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: not UTF-8 text: {error}") from error
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror}") from error


def read_table(path: Path, columns: Iterable[str]) -> list[dict[str, str]]:
    """These columns of the rows of a CSV file with a header.

    Raises:
        DataError: the file is missing or no CSV file, or a row lacks one of the columns.
    """
    reader = csv.reader(read_text(path, errors="strict").splitlines(keepends=True))
    try:
        header, *rows = [row for row in reader if row] or [[]]
    except csv.Error as error:
        raise DataError(f"{path}:{reader.line_num}: {error}") from error
    places = {}
    for column in columns:
        if column not in header or any(len(row) <= header.index(column) for row in rows):
            raise DataError(f"{path}: column {column!r} is missing")
        places[column] = header.index(column)
    return [{column: row[place] for column, place in places.items()} for row in rows]


def is_finite(word: str) -> bool:
    """Whether a word of a text file is a number, and not beyond LARGEST_VALUE."""
    try:
        return abs(float(word)) <= LARGEST_VALUE
    except ValueError:
        return False
