"""Files of one's own below a folder, each of one action, and what their names or a table say of it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from motiongen.data.clips import DataError, Job, Sequence
from motiongen.data.roots import check_root
from motiongen.data.sources.files import digest
from motiongen.data.sources.folder import LABELS, read_labels


@dataclass(frozen=True)
class Label:
    """What a file is."""

    name: str
    """Of its sequence."""
    tags: tuple[str, ...]
    styles: tuple[str, ...]
    group: str
    """Files of one group never straddle the split."""


class LabelledFiles:
    """Files whose names end alike, in the order of their names.

    Args:
        root: the folder.
        ending: what their names end in, like `.bvh`, in small or capital letters.
        pattern: a regular expression that a file's name without its ending matches as a whole. Its group `tag` is the
            action (several with `+` between them), its optional groups `style` and `group` are the manner, and what
            files that never straddle the split have in common. Without a pattern, `labels.csv` with columns `file` and
            `tags` is read if it is there; else the name of a file's folder is its tag.
        besides: patterns of names, as of the shell, that are not motion.

    Raises:
        DataError: the folder, the pattern or the labels are missing or wrong, or there are no files.
    """

    def __init__(self, root: str, ending: str, pattern: str | None = None, besides: Iterable[str] = ()) -> None:
        self.root = check_root(root)
        self._pattern = None if pattern is None else _compiled(pattern)
        table = self.root / LABELS
        self._labels = read_labels(table) if pattern is None and table.is_file() else None
        if self._labels is None:
            found = (path for path in self.root.rglob("*") if path.suffix.lower() == ending)
            self.paths = sorted(path for path in found if not any(path.match(name) for name in besides))
        else:
            self.paths = [self.root / file for file in self._labels]
        if not self.paths:
            raise DataError(f"{self.root}: no {ending} files")

    def fingerprint(self, *settings: object) -> str:
        """Of the files, their labels, and settings that change what is made of them."""
        files = [path for path in self.paths if self.is_inside(path)]
        pattern = None if self._pattern is None else self._pattern.pattern
        return digest(self.root, files, pattern, self._labels, *settings)

    def jobs(self, read: Callable[[Path], Iterable[Sequence]]) -> list[Job]:
        """A job for every file."""
        return [Job(path.relative_to(self.root).as_posix(), (path,), partial(read, path)) for path in self.paths]

    def is_inside(self, path: Path) -> bool:
        """Whether it is a file, and no link that leads out of the folder."""
        return path.is_file() and path.resolve().is_relative_to(self.root.resolve())

    def label(self, path: Path) -> Label:
        """What one of the files is.

        Raises:
            DataError: it leads out of the folder, or its name does not match the pattern.
        """
        if not self.is_inside(path):
            raise DataError(f"{path}: is missing or leads out of the folder")
        file = path.relative_to(self.root)
        name, itself = _printable(file.with_suffix("").as_posix()), _printable(file.as_posix())
        if self._labels is not None:
            return Label(name, self._labels[file.as_posix()], (), itself)
        if self._pattern is None:
            return Label(name, (_printable(path.absolute().parent.name),), (), itself)
        match = self._pattern.fullmatch(path.stem)
        if match is None:
            raise DataError(f"{path}: data.source.pattern: {self._pattern.pattern!r} does not match the name")
        found = {group: _printable(text) for group, text in match.groupdict().items() if text}
        tags = tuple(tag.strip() for tag in found.get("tag", "").split("+"))
        return Label(name, tags, (found["style"],) if "style" in found else (), found.get("group", itself))


def _compiled(pattern: str) -> re.Pattern[str]:
    try:
        compiled = re.compile(pattern)
    except re.error as error:
        raise DataError(f"data.source.pattern: {pattern!r}: {error}") from error
    if "tag" not in compiled.groupindex:
        raise DataError(f"data.source.pattern: {pattern!r} has no group (?P<tag>...)")
    return compiled


def _printable(text: str) -> str:
    """Names of files that are not UTF-8 in a form that can be written."""
    return text.encode("utf-8", "backslashreplace").decode()
