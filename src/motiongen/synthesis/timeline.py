"""Timelines as a user writes them: `walk 2 s, sit down 1.5 s, wave hand 2 s`."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass

from motiongen.errors import InputError

_ENTRY = re.compile(r"^(?P<tags>.*\S)\s+(?P<seconds>\d+(\.\d+)?)\s*s?$")


class TimelineError(InputError):
    """A timeline that cannot be read; the message names the entry."""


@dataclass(frozen=True)
class Action:
    """One entry of a timeline."""

    tags: tuple[str, ...]
    seconds: float

    def frames(self, fps: float) -> int:
        """The number of frames to generate, at least 1."""
        return max(1, round(self.seconds * fps))


def parse_timeline(text: str, vocabulary: Sequence[str]) -> tuple[Action, ...]:
    """Read `tag seconds s, tag + tag seconds s, ...`.

    Args:
        text: the timeline; several tags at once are joined by `+`.
        vocabulary: the tags that the generator knows.

    Raises:
        TimelineError: an entry without a duration, a duration that is not positive, or an unknown tag.
    """
    actions = []
    for entry in (part.strip() for part in text.split(",")):
        match = _ENTRY.match(entry)
        if match is None:
            raise TimelineError(f"timeline: {entry!r} is not of the form 'tag seconds s', such as 'walk 2 s'")
        seconds = float(match["seconds"])
        if seconds <= 0:
            raise TimelineError(f"timeline: {entry!r} lasts {seconds} s; a duration is positive")
        tags = tuple(tag.strip() for tag in match["tags"].split("+"))
        for tag in tags:
            if tag not in vocabulary:
                near = difflib.get_close_matches(tag, vocabulary, n=1)
                hint = f"did you mean {near[0]!r}? " if near else ""
                raise TimelineError(f"timeline: unknown tag {tag!r}; {hint}known tags: {', '.join(vocabulary)}")
        actions.append(Action(tags, seconds))
    return tuple(actions)
