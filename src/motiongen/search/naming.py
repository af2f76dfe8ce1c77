"""Where a search and its trials lie."""

from __future__ import annotations

from pathlib import Path

SEARCH = "search"
"""The option of Hydra's sweeper that searches."""


def search_folder(name: str) -> Path:
    """Of the search of this name, below the working folder."""
    return Path("runs", "search", name)


def trial_folder(number: int) -> str:
    """Of a trial's job, in that of the search."""
    return f"trial-{number:04d}"
