"""Is a data set there? Without torch, so that a run with a wrong folder fails at once."""

from __future__ import annotations

from pathlib import Path

from motiongen.errors import InputError


class DataError(InputError):
    """A data set that is missing, damaged or not of the promised form; the message names the file and the field."""


def check_root(root: str | Path, option: str = "data.source.root") -> Path:
    """The data set's folder.

    Args:
        root: a folder; a relative one is looked up from the working folder.
        option: the setting to name when the folder is missing.

    Raises:
        DataError: there is no such folder.
    """
    folder = Path(root).expanduser()
    if not folder.is_dir():
        raise DataError(
            f"{option}: folder {folder.absolute()} does not exist; set {option}=<the data set's folder>, or the "
            f"environment variable MOTIONGEN_SHARED_DATA to the folder above it"
        )
    return folder
