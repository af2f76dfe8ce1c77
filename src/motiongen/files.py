"""Files that are whole or absent."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path beside `path` to write to. It takes that place when the block ends; if the block fails, it is removed.

    Its suffix is that of `path`, as some writers choose by it; processes that write at once do not meet.
    """
    partial = path.with_name(f".{os.getpid()}.{path.name}")
    try:
        yield partial
        os.replace(partial, path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def is_file(path: Path) -> bool:
    """Whether there is a file; also of names that no file can have."""
    try:
        return path.is_file()
    except OSError:
        return False
