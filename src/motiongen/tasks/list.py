"""`task=list`: every option of every group, with one line about each."""

from __future__ import annotations

from omegaconf import DictConfig

from motiongen.discovery import options
from motiongen.usage import table


def run(config: DictConfig) -> None:
    """Print the table; the configuration does not matter."""
    print(table(options()))
