"""Where a search keeps its trials: a journal file or a database, which several workers may share."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from motiongen.errors import InputError

if TYPE_CHECKING:
    from optuna.storages import BaseStorage

SECONDS_TO_WAIT = 30.0
"""How long a locked database is waited for, each time."""
TRIES = 4

Result = TypeVar("Result")
_log = logging.getLogger(__name__)


class StorageError(InputError):
    """A storage that cannot be reached."""


def open_storage(place: str) -> BaseStorage:
    """A database where `place` is an address such as sqlite:///search.db, else a journal file.

    Raises:
        StorageError: it cannot be opened, or is damaged.
    """
    from optuna.exceptions import StorageInternalError
    from optuna.storages import JournalStorage, RDBStorage
    from optuna.storages.journal import JournalFileBackend
    from sqlalchemy.exc import SQLAlchemyError

    try:
        if "://" in place:
            wait = {"connect_args": {"timeout": SECONDS_TO_WAIT}} if place.startswith("sqlite") else {}
            return RDBStorage(place, engine_kwargs=wait)
        Path(place).parent.mkdir(parents=True, exist_ok=True)
        return JournalStorage(JournalFileBackend(place))
    except (OSError, ImportError, SQLAlchemyError, StorageInternalError) as error:
        raise StorageError(f"hydra.sweeper.storage={place}: cannot be opened: {error}") from error
    except Exception as error:
        # Optuna believes whatever a line of its journal says.
        told = f"{type(error).__name__}: {error!s:.500}"
        raise StorageError(
            f"hydra.sweeper.storage={place}: is damaged, or is no journal of a search: {told}"
        ) from error


def patiently(action: Callable[[], Result], place: str) -> Result:
    """What `action` returns; where the storage is locked, it is tried again for about two minutes.

    Raises:
        StorageError: the storage stays locked. Nothing that was written before is lost.
    """
    from optuna.exceptions import StorageInternalError

    for attempt in range(1, TRIES + 1):
        try:
            return action()
        except StorageInternalError as error:
            cause = error.__cause__ or error
            _log.warning(
                "The storage %s is not to be had (%s); try %d of %d", place, _first_line(cause), attempt, TRIES
            )
            last = cause
            time.sleep(attempt)
    raise StorageError(
        f"hydra.sweeper.storage={place}: {_first_line(last)}. What was measured lies in the trials' folders; the same "
        "command goes on from there once the storage can be written"
    ) from last


def _first_line(error: BaseException) -> str:
    return str(error).splitlines()[0]
