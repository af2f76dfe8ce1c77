"""What `--help` and `task=list` print."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from motiongen.discovery import CORE, Option

BUILT_IN = (CORE, "motiongen_plugins")
SLOTS = {
    "generator": "a whole generator; staged has the slots below",
    "generator/encoder": "condition, and in training the motion, to the distribution of a code z",
    "generator/conditioning": "z to z', under the condition",
    "generator/unroller": "z' to one control for every frame",
    "generator/unroller/query": "a list: what an unroller's query is the sum of",
    "generator/unroller/branches": "a list: further controls of every frame beside the unrolled code",
    "generator/decoder": "controls to motion",
    "generator/decoder/layer_input": "a list: what is added to the input of a decoder's layers",
    "generator/training": "how the decoder is shown its past while it learns",
    "generator/pose": "the form in which the stages see a pose",
    "generator/words": "runs of poses to words and back",
    "generator/cell": "the recurrent unit over words",
    "generator/classifier": "poses to an action or style",
    "generator/denoiser": "what cleans the motion that words are read from",
    "objective": "what training makes small",
    "corrections": "with which corrections long motion is judged, one after another",
    "sequences": "which sequences of actions long motion is judged on",
    "correction": "what acts against drift where long motion is made of actions",
}
"""What the options of a group are for, where its name does not say it."""

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
    """Plain text, options of one group together; an option that another package brought is followed by its plugin."""
    width = max((len(option.name) for option in found), default=0)
    lines: list[str] = []
    for group, members in groupby(found, key=lambda option: option.group):
        lines += ["", f"{group}: {SLOTS[group]}" if group in SLOTS else group]
        for option in members:
            origin = "" if option.plugin.partition(".")[0] in BUILT_IN else f"  [{option.plugin}]"
            lines.append(f"  {option.name:<{width}}  {option.description}{origin}")
    return "\n".join(lines[1:])
