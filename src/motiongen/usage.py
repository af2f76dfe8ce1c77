"""What `--help` and `task=list` print."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from motiongen.discovery import CORE, Option

HELP = """\
python -m motiongen [+experiment=...] [task=...] [group=option ...] [key=value ...]

  python -m motiongen +experiment=marionette                    train on the built-in data, evaluate, preview
  python -m motiongen +experiment=marionette data=bandai seed=1
  python -m motiongen resume=runs/...                           go on with a training run that was interrupted
  python -m motiongen task=evaluate run=runs/...                use the generator that a run trained
  python -m motiongen -m +experiment=marionette seed=0,1,2      one run for each value

{tasks}

{experiments}

Other groups (task=list describes every option):
{groups}

--cfg job prints the configuration of a command line without running it; --hydra-help explains Hydra's own flags.
"""


def help_text(found: Sequence[Option]) -> str:
    """How to call the program and what there is to choose."""
    groups = {group: list(members) for group, members in groupby(found, key=lambda option: option.group)}
    shown = ("task", "experiment")
    return HELP.format(
        tasks=table(groups.get("task", ())),
        experiments=table(groups.get("experiment", ())),
        groups="\n".join(
            f"  {group}: {', '.join(option.name for option in members)}"
            for group, members in groups.items()
            if group not in shown
        ),
    )


def table(found: Sequence[Option]) -> str:
    """Plain text, options of one group together; the plugin is named where an option is not the core's."""
    width = max((len(option.name) for option in found), default=0)
    lines: list[str] = []
    for group, members in groupby(found, key=lambda option: option.group):
        lines += ["", group]
        for option in members:
            origin = "" if option.plugin == CORE else f"  [{option.plugin}]"
            lines.append(f"  {option.name:<{width}}  {option.description}{origin}")
    return "\n".join(lines[1:])
