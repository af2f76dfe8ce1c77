"""What happens before and after the rows of a study: the tracker's run that they belong to, and what became of them."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from hydra.experimental.callback import Callback
from omegaconf import DictConfig

from motiongen.resolvers import changes_in
from motiongen.studies.naming import swept_changes, swept_study

if TYPE_CHECKING:
    from motiongen.tracking.tracker import Tracker


class StudyCallback(Callback):
    """Opens a study's run before its rows start, so that they find it, and sums up in the end.

    Other multiruns are left alone.
    """

    def on_multirun_start(self, config: DictConfig, config_name: str | None = None) -> None:  # type: ignore[override]
        study = swept_study(config.hydra.overrides.task)
        if study is None:
            return
        folder = Path(config.hydra.sweep.dir)
        folder.mkdir(parents=True, exist_ok=True)
        _started(config, study, folder)

    def on_multirun_end(self, config: DictConfig, config_name: str | None = None) -> None:  # type: ignore[override]
        study = swept_study(config.hydra.overrides.task)
        if study is None:
            return
        from motiongen.studies.rows import changes_of, failure, row_folders, state_of

        folder = Path(config.hydra.sweep.dir)
        own = swept_changes(changes_in(config.hydra.overrides.task))
        states = {path: state_of(path) for path in row_folders(folder) if changes_of(path) in own}
        counts = Counter(states.values())
        tracker = _started(config, study, folder)
        tracker.log_metrics({f"rows/{state}": float(counts[state]) for state in ("done", "failed", "unfinished")})
        tracker.finish()
        print(f"{study}: {counts['done']} rows and seeds done, in {folder}")
        for path, state in states.items():
            if state != "done":
                print(f"- {path.name}: {failure(path) if state == 'failed' else 'unfinished'}")
        data, scale = (config.hydra.runtime.choices[group] for group in ("data", "scale"))
        for changes in own:
            line = f"python -m motiongen task=report study={study} data={data} scale={scale} {changes}"
            print(f"The table: {line.rstrip()}")
        if counts["failed"]:
            sys.exit(
                f"motiongen: {counts['failed']} rows failed; the same command with retry_failed=true runs them again"
            )


def _started(config: DictConfig, study: str, folder: Path) -> Tracker:
    """The tracker with the study's run, which goes on where it was begun before."""
    from hydra.utils import instantiate

    tracker: Tracker = instantiate(config.tracker)
    tracker.start(f"{study}-{folder.name}", {}, {"study": study}, folder)
    return tracker
