"""What a task tells about its run, whoever keeps it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, Protocol

Status = Literal["FINISHED", "FAILED", "KILLED"]


class Tracker(Protocol):
    """Keeps runs. Between `start` and `finish`, in the order of the calls."""

    def start(
        self,
        name: str,
        config: Mapping[str, Any],
        tags: Mapping[str, str],
        folder: Path | None = None,
        parent: Path | None = None,
    ) -> None:
        """Begins a run.

        Args:
            name: what ran, for people.
            config: the resolved configuration.
            tags: what to search runs by.
            folder: the run's folder. A run that was begun with the same folder before, and was interrupted, goes on.
            parent: the folder of the run that this one is a part of.
        """
        ...

    def log_metrics(self, values: Mapping[str, float], step: int | None = None) -> None:
        """Numbers, of a step of the training or of the whole run."""
        ...

    def log_table(self, name: str, rows: Sequence[Mapping[str, Any]]) -> None:
        """Rows with the same keys, shown as a table called `name`."""
        ...

    def log_data(self, name: str, fingerprint: str, facts: Mapping[str, Any]) -> None:
        """Which data the run is about: its name, the digest that tells it from others, and what is known of it."""
        ...

    def log_artifact(self, path: Path, folder: str = "") -> None:
        """A file, or a folder with all that is in it, kept under `folder`."""
        ...

    def finish(self, status: Status = "FINISHED") -> None:
        """Ends the run."""
        ...

    def how_to_open(self) -> str:
        """The command line that shows the runs; empty if there is nothing to show."""
        ...
