"""Runs one row of a study with one seed: unless that was done before, and from where it was interrupted.

A row and seed have a folder of their own, whatever command line asks for them, and what lies there says how far they
came: `row.json` which configuration, data and code it was begun with, a checkpoint that it can go on, `summary.json`
that it is done, `failed.json` that it broke off and why.
"""

from __future__ import annotations

import json
import logging
import shutil
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from filelock import FileLock, Timeout
from omegaconf import DictConfig, open_dict

from motiongen.errors import input_error
from motiongen.files import replacing
from motiongen.resolvers import changes_in
from motiongen.runs import CHECKPOINT, SUMMARY_FILE, stored_overrides
from motiongen.studies.identity import Identity, identity_of, read_identity
from motiongen.studies.naming import changes_text

ROW_FILE = "row.json"
FAILED_FILE = "failed.json"
LOCK_FILE = "row.lock"
EARLIER = "earlier"
KEPT_IN_PLACE = {LOCK_FILE, EARLIER, ".hydra", "motiongen.log"}
"""What belongs to the folder and not to what was done in it."""

State = Literal["done", "failed", "unfinished"]
_log = logging.getLogger(__name__)


def run_row(task: Callable[[DictConfig], None], config: DictConfig, folder: Path) -> None:
    """Do what is left to do of a row. Never raises for what the row itself does wrong: other rows have to run.

    Args:
        task: what the row does.
        config: its configuration, of which `reuse` and `retry_failed` are read here.
        folder: of this row and seed; Hydra has made it.
    """
    try:
        with FileLock(folder / LOCK_FILE, timeout=0):
            _run(task, config, folder)
    except Timeout:
        _log.info("%s: another process is at it; left to it", folder.name)


def _run(task: Callable[[DictConfig], None], config: DictConfig, folder: Path) -> None:
    try:
        identity = identity_of(config)
        if not _left_to_do(config, identity, folder):
            return
        _take_over(identity, folder)
        if any(folder.glob(f"checkpoints/{CHECKPOINT}")):
            _log.info("%s: goes on from its last checkpoint", folder.name)
            with open_dict(config):
                config.resume = str(folder)
        _write(folder / ROW_FILE, identity.to_json())
        task(config)
    except Exception as error:
        reason = str(input_error(error) or f"{type(error).__name__}: {error}")
        _write(folder / FAILED_FILE, {"reason": reason, "trace": traceback.format_exc()})
        _log.error("%s: failed: %s", folder.name, reason)


def _left_to_do(config: DictConfig, identity: Identity, folder: Path) -> bool:
    """Whether the row has to run; what does not count any more is moved to `earlier/`."""
    state = state_of(folder)
    if differing := _outdated(str(config.reuse), identity, folder):
        place = set_aside(folder)
        _log.info("%s: begun with other %s, which is kept in %s", folder.name, " and ".join(differing), place)
        return True
    if state == "done":
        _log.info("%s: done before under the same configuration, data and code; reused", folder.name)
        return False
    if state == "failed" and not config.retry_failed:
        _log.info("%s: failed before: %s; retry_failed=true runs it again", folder.name, failure(folder))
        return False
    (folder / FAILED_FILE).unlink(missing_ok=True)
    return True


def _take_over(identity: Identity, folder: Path) -> None:
    """Copies the last checkpoint of a row of another study that is done and the same, so that none trains it again."""
    own = folder / "checkpoints" / CHECKPOINT
    if own.is_file():
        return
    for path in sorted(folder.parents[2].glob(f"*/{folder.parent.name}/*/{ROW_FILE}")):
        trained = path.parent / "checkpoints" / CHECKPOINT
        if state_of(path.parent) == "done" and trained.is_file() and not identity.differences(read_identity(path)):
            own.parent.mkdir(exist_ok=True)
            with replacing(own) as partial:
                shutil.copyfile(trained, partial)
            _log.info("%s: trained before as %s", folder.name, path.parent.relative_to(folder.parents[2]))
            return


def _outdated(reuse: str, identity: Identity, folder: Path) -> list[str]:
    if not (folder / ROW_FILE).is_file():
        return []
    differing = identity.differences(read_identity(folder / ROW_FILE))
    return [field for field in differing if not (field == "code" and reuse == "any_code")]


def set_aside(folder: Path) -> Path:
    """Moves what was done in a row's folder out of the way, and says where to."""
    place = folder / EARLIER / str(len(list(folder.glob(f"{EARLIER}/*"))) + 1)
    place.mkdir(parents=True)
    for path in list(folder.iterdir()):
        if path.name not in KEPT_IN_PLACE:
            path.rename(place / path.name)
    return place


def state_of(folder: Path) -> State:
    """How far a row came."""
    if (folder / SUMMARY_FILE).is_file():
        return "done"
    return "failed" if (folder / FAILED_FILE).is_file() else "unfinished"


def failure(folder: Path) -> str:
    """Why a row failed, in a line."""
    reason = read_identity(folder / FAILED_FILE).get("reason", "for a reason that was not written down")
    return next(iter(str(reason).splitlines()), "")


def row_folders(study: Path) -> list[Path]:
    """The folders of the rows of a study that were begun, in the order of their names."""
    return sorted(path.parent for path in study.glob(f"*/{LOCK_FILE}"))


def changes_of(folder: Path) -> str:
    """The overrides that a row was last asked for with, as `changes_text` writes them.

    Raises:
        RunError: what Hydra stored of them is gone or damaged.
    """
    return changes_text(changes_in(stored_overrides(folder, "study", trust=True)))  # told, never run


def _write(path: Path, values: dict[str, str]) -> None:
    with replacing(path) as partial:
        partial.write_text(json.dumps(values, indent=2) + "\n", encoding="utf-8")
