"""Timelines as a user writes them: `walk 2 s, sit down 1.5 s, wave hand 2 s`, or a YAML or JSON document.

Nothing heavy is imported: the command line reads a timeline before anything is loaded.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from motiongen.documents import DocumentError, read_json, read_yaml
from motiongen.errors import InputError
from motiongen.schemas import problem_in
from motiongen.suggestions import did_you_mean

FPS = 30.0
LARGEST = 2**20
"""Bytes of a document in JSON; a timeline of a thousand actions has a tenth of it."""
ENDINGS = (".yaml", ".yml", ".json")
Point = tuple[float, float]

_ENTRY = re.compile(r"^(?P<tags>.*\S)\s+(?P<seconds>\d+(\.\d+)?)\s*s?$")


class TimelineError(InputError):
    """A timeline that cannot be read; the message names the document and the field."""


@dataclass(frozen=True)
class Action:
    """One entry of a timeline."""

    tags: tuple[str, ...]
    seconds: float
    path: tuple[Point, ...] | None = None
    """Points on the floor, metres"""

    @property
    def frames(self) -> int:
        """How many frames are generated."""
        return round(self.seconds * FPS)

    @property
    def label(self) -> str:
        """The tags as they are shown."""
        return " + ".join(self.tags)


@dataclass(frozen=True)
class Start:
    """What a motion begins from: a clip of the data, or a file."""

    clip: str | None = None
    file: Path | None = None
    frame: int | None = None


@dataclass(frozen=True)
class Timeline:
    """Actions in order, and all that a user may say about the motion made of them."""

    actions: tuple[Action, ...]
    path: tuple[Point, ...] | None = None
    start: Start | None = None
    style: str | None = None
    seed: int | None = None
    variants: int | None = None
    name: str = "timeline"
    """For messages: the document's path, or `timeline` for one line of text."""

    @property
    def title(self) -> str:
        """All actions in one line."""
        return ", ".join(f"{action.label} {action.seconds:g} s" for action in self.actions)


@cache
def schema() -> dict[str, Any]:
    """The JSON schema of the documents."""
    text = (files("motiongen.synthesis") / "timeline.schema.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def read_timeline(text: str) -> Timeline:
    """A timeline from one line of text, or from the document that it names by a path ending in .yaml, .yml or .json.

    Tags are as they are written; `resolve` finds out which ones are meant.

    Raises:
        TimelineError: no such document, or not of the form that the schema describes.
    """
    return _document(Path(text).expanduser()) if text.strip().endswith(ENDINGS) else _line(text)


def resolve(timeline: Timeline, vocabulary: Sequence[str]) -> Timeline:
    """The timeline with tags as the data has them.

    Raises:
        TimelineError: an unknown tag.
    """
    plain = {_plain(tag): tag for tag in vocabulary}
    actions = []
    for number, action in enumerate(timeline.actions):
        tags = []
        for tag in action.tags:
            known = tag if tag in vocabulary else plain.get(_plain(tag))
            if known is None:
                near = did_you_mean(tag, vocabulary)
                where = f"{timeline.name}: actions[{number}].tags"
                raise TimelineError(f"{where}: unknown tag {tag!r}{near}\n  tags: {', '.join(vocabulary)}")
            if known in tags:
                raise TimelineError(f"{timeline.name}: actions[{number}].tags: {known!r} is there twice")
            tags.append(known)
        actions.append(replace(action, tags=tuple(tags)))
    return replace(timeline, actions=tuple(actions))


def _plain(tag: str) -> str:
    """What tags have in common that differ in spaces, - and _ alone."""
    return re.sub(r"[\s_-]+", " ", tag.strip()).casefold()


def _line(text: str) -> Timeline:
    actions = []
    for entry in (part.strip() for part in text.split(",")):
        match = _ENTRY.match(entry)
        if match is None:
            raise TimelineError(f"timeline: {entry!r} is not of the form 'tag seconds s', such as 'walk 2 s'")
        tags = tuple(tag.strip() for tag in match["tags"].split("+"))
        if not all(tags):
            raise TimelineError(f"timeline: {entry!r}: there is no tag on one side of a +")
        actions.append(Action(tags, float(match["seconds"])))
    return _checked(Timeline(tuple(actions)))


def _document(path: Path) -> Timeline:
    try:
        content = read_json(path, LARGEST) if path.suffix == ".json" else read_yaml(path)
    except DocumentError as error:
        raise TimelineError(f"{path}: {error}") from error
    if problem := problem_in(content, schema()):
        raise TimelineError(f"{path}: {problem}")
    start = content.get("start")
    try:
        timeline = Timeline(
            actions=tuple(_action(entry) for entry in content["actions"]),
            path=_points(content.get("path")),
            start=None if start is None else _start(start, path),
            style=content.get("style"),
            seed=content.get("seed"),
            variants=content.get("variants"),
            name=str(path),
        )
    except OverflowError as error:
        raise TimelineError(f"{path}: a number is too large: {error}") from error
    return _checked(timeline)


def _action(entry: dict[str, Any]) -> Action:
    tags = entry["tags"]
    tags = [tags] if isinstance(tags, str) else tags
    return Action(tuple(tag.strip() for tag in tags), float(entry["seconds"]), _points(entry.get("path")))


def _points(points: list[list[float]] | None) -> tuple[Point, ...] | None:
    return None if points is None else tuple((float(x), float(y)) for x, y in points)


def _start(start: dict[str, Any], document: Path) -> Start:
    if ("clip" in start) == ("file" in start):
        raise TimelineError(f"{document}: start: takes either a clip or a file")
    file = document.parent / start["file"] if "file" in start else None
    if file is not None and not file.is_file():
        raise TimelineError(f"{document}: start.file: there is no file {file}")
    return Start(start.get("clip"), file, start.get("frame"))


def _checked(timeline: Timeline) -> Timeline:
    """What holds whatever the data is.

    Raises:
        TimelineError: it does not.
    """
    for number, action in enumerate(timeline.actions):
        where = f"{timeline.name}: actions[{number}]"
        if not math.isfinite(action.seconds * FPS):
            raise TimelineError(f"{where}.seconds: {action.seconds} is not a duration")
        if action.frames < 1:
            raise TimelineError(f"{where}.seconds: {action.seconds:g} s is less than a frame ({1 / FPS:.3f} s)")
        if action.path is not None:
            _check_path(action.path, f"{where}.path")
            if timeline.path is not None:
                raise TimelineError(f"{where}.path: the timeline has a path for all its actions; leave one of them out")
    if timeline.path is not None:
        _check_path(timeline.path, f"{timeline.name}: path")
    return timeline


def _check_path(path: Iterable[Point], where: str) -> None:
    points = list(path)
    if not all(math.isfinite(value) for point in points for value in point):
        raise TimelineError(f"{where}: has a point that is not finite")
    if len(set(points)) == 1:
        raise TimelineError(f"{where}: all its points are one; for an action in place, leave the path out")
