"""Which study and which of its rows a command line speaks of, and where a study's rows lie.

A row is a file `conf/ablation/<study>/<row>.yaml`, added with `+ablation/<study>=<row>`.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Glob, Override

from motiongen.discovery import options
from motiongen.errors import InputError

GROUP = "ablation/"
CHANGES = "changes"
"""The tag in the tracker of what the command line changed about a row, as `changes_text` writes it"""
STUDIES = Path("runs", "studies")


class StudyError(InputError):
    """A command line or a folder that is not that of a study."""


@dataclass(frozen=True)
class Row:
    """One row of a study's table."""

    study: str
    name: str


def chosen_row(choices: Mapping[str, Any]) -> Row | None:
    """The row among Hydra's choices (`hydra.runtime.choices`), if there is one.

    Raises:
        StudyError: rows of two studies.
    """
    rows = [Row(group.removeprefix(GROUP), str(name)) for group, name in choices.items() if group.startswith(GROUP)]
    if len(rows) > 1:
        raise StudyError(f"one study at a time: +{' +'.join(f'{GROUP}{row.study}={row.name}' for row in rows)}")
    return rows[0] if rows else None


def swept_study(overrides: Iterable[str]) -> str | None:
    """The study whose rows the overrides of a command line add, swept or not."""
    keys = (text.lstrip("+").partition("=")[0] for text in overrides)
    return next((key.removeprefix(GROUP) for key in keys if key.startswith(GROUP)), None)


def changes_text(changes: Iterable[str]) -> str:
    """Overrides that were made to a row, as they can be typed: the same text however they were typed."""
    return swept_changes(changes)[0]


def swept_changes(changes: Iterable[str]) -> list[str]:
    """The same of overrides that may sweep over something: a text for every combination."""
    parsed = OverridesParser.create().parse_overrides(list(changes))
    return [shlex.join(sorted(chosen)) for chosen in product(*map(_spelled, parsed))]


def _spelled(override: Override) -> list[str]:
    """As Hydra hands them to the jobs of a multirun."""
    value = override.value()
    if isinstance(value, Glob):
        values = value.filter([option.name for option in options() if option.group == override.key_or_group])
    elif override.is_sweep_override():
        values = list(override.sweep_string_iterator())
    else:
        values = [override.get_value_element_as_str()]
    return [f"{override.get_key_element()}={value}" for value in values]


def study_folder(study: str, data: str, scale: str) -> Path:
    """Where the rows of a study on this data and scale lie, below the working folder."""
    return STUDIES / study / f"{data}-{scale}"
