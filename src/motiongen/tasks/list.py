"""task=list: every option of every group, with one line about each."""

from __future__ import annotations

from itertools import groupby

from omegaconf import DictConfig

from motiongen.discovery import CORE, Option, options


def run(config: DictConfig) -> None:
    print(table(options()))


def table(found: tuple[Option, ...]) -> str:
    """Plain text, options of one group together; the plugin is named where an option is not the core's."""
    width = max((len(option.name) for option in found), default=0)
    lines: list[str] = []
    for group, members in groupby(found, key=lambda option: option.group):
        lines.append(group)
        for option in members:
            origin = "" if option.plugin == CORE else f"  [{option.plugin}]"
            lines.append(f"  {option.name:<{width}}  {option.description}{origin}")
        lines.append("")
    return "\n".join(lines).rstrip()
