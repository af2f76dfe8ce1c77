"""`tracker=none`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from motiongen.tracking.tracker import Status


class NoTracker:
    """Keeps nothing."""

    def start(
        self,
        name: str,
        config: Mapping[str, Any],
        tags: Mapping[str, str],
        folder: Path | None = None,
        parent: Path | None = None,
    ) -> None: ...

    def log_metrics(self, values: Mapping[str, float], step: int | None = None) -> None: ...

    def log_table(self, name: str, rows: Sequence[Mapping[str, Any]]) -> None: ...

    def log_data(self, name: str, fingerprint: str, facts: Mapping[str, Any]) -> None: ...

    def log_artifact(self, path: Path, folder: str = "") -> None: ...

    def finish(self, status: Status = "FINISHED") -> None: ...

    def how_to_open(self) -> str:
        return ""
