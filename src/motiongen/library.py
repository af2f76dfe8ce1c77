"""The verbs of the command line as functions, for use from Python."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from motiongen.configuration import check
from motiongen.export.scene import Scene
from motiongen.runs import completed, quoted


def synthesize(
    run: str | Path, timeline: str | Path, *, seed: int = 0, variants: int = 1, overrides: Sequence[str] = ()
) -> list[Scene]:
    """Long motion from a timeline, as `task=synthesize` makes it; nothing is written.

    Args:
        run: the folder of a finished training run.
        timeline: the actions in one line, `walk 2 s, wave hand 2 s`, or the path of a YAML or JSON document.
        seed: where the timeline has none.
        variants: how many motions, where the timeline does not say it.
        overrides: anything else that the command line takes, such as `correction=action_revision` or `rank=true`.

    Returns:
        One scene a motion; `motiongen.export.write.write("motion.bvh", scene)` makes a file of it, and
        `motiongen.export.html.write_page("motion.html", scenes)` a page.

    Raises:
        InputError: something in the arguments is wrong; the message names it.
    """
    line = ["task=synthesize", f"run={quoted(run)}", f"timeline={quoted(timeline)}", f"seed={seed}"]
    config = check(completed([*line, f"variants={variants}", *overrides]))

    from motiongen.synthesis.timeline import read_timeline, resolve
    from motiongen.tasks.assembly import build_data
    from motiongen.tasks.synthesize import perform, scenes_of

    data = build_data(config)
    actions = resolve(read_timeline(config.timeline), data.tags)
    return scenes_of(config, actions, perform(config, actions, data), data)
