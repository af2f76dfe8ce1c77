"""Which trials are being worked at: every worker holds a lock for as long as it lives."""

from __future__ import annotations

import uuid
from pathlib import Path
from types import TracebackType
from typing import Self

from filelock import FileLock, Timeout


class Worker:
    """This process among the workers of a search. The system frees its lock when it dies, however it dies.

    Args:
        folder: where the workers' locks lie; shared by all.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        self.name = uuid.uuid4().hex
        self._lock = FileLock(folder / f"{self.name}.lock")

    def __enter__(self) -> Self:
        self._lock.acquire()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._lock.release()
        (self._folder / f"{self.name}.lock").unlink(missing_ok=True)

    def is_alive(self, name: str) -> bool:
        """Whether the worker of that name still runs."""
        path = self._folder / f"{name}.lock"
        if name == self.name:
            return True
        if not path.is_file():
            return False
        try:
            with FileLock(path, timeout=0):
                return False
        except Timeout:
            return True
