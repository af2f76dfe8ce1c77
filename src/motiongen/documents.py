"""JSON and YAML files that a stranger or a crash may have touched. Nothing heavy is imported."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import yaml

LARGEST = 2**24
"""Bytes of a JSON file; a run's summary with a hundred systems has a fifth of it."""
LARGEST_YAML = 2**20
"""Bytes of a YAML file, of which a second reads no more."""


class DocumentError(ValueError):
    """A document that cannot be read. The message says why in one line and leaves the file's name to the caller."""


def read_json(path: Path, largest: int = LARGEST, *, printable: bool = True) -> Any:
    """A JSON file's content: text that can be printed, numbers that are finite, every field once.

    Args:
        path: the file.
        largest: the most bytes that it may have.
        printable: without it, text and numbers may be anything; names of files need not be UTF-8.

    Raises:
        DocumentError: no such file, too large, or not JSON.
    """
    text = _text(path, largest)
    try:
        content = json.loads(text, object_pairs_hook=_unique)
        if printable:
            _refuse_unprintable(content, allow_nan=False)
    except (ValueError, RecursionError) as error:
        raise DocumentError(f"cannot be read as JSON: {_one_line(error)}") from error
    return content


def read_yaml(path: Path) -> Any:
    """A YAML file's content: plain values, every field once, without aliases.

    Raises:
        DocumentError: no such file, too large, or not such YAML.
    """
    text = _text(path, LARGEST_YAML)
    try:
        content = yaml.load(text, _PlainLoader)
        _refuse_unprintable(content, allow_nan=True)
    except Exception as error:
        # A value under the wrong tag, such as `!!bool x`, makes PyYAML raise nearly anything.
        raise DocumentError(f"cannot be read as YAML: {_one_line(error)}") from error
    return content


def _text(path: Path, largest: int) -> str:
    try:
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            if size > largest:
                raise DocumentError(f"larger than {largest} bytes")
            content = file.read(size)
    except OSError as error:
        raise DocumentError(f"cannot be read: {error.strerror}") from error
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise DocumentError(f"not UTF-8 text: {error}") from error


def _refuse_unprintable(content: Any, *, allow_nan: bool) -> None:
    """Raises ValueError for what readers admit and no message can show: halves of characters, endless numbers."""
    json.dumps(content, default=str, ensure_ascii=False, allow_nan=allow_nan).encode()


def _one_line(error: Exception) -> str:
    return f"{' '.join(str(error).split()) or type(error).__name__:.500}"


def _unique(pairs: list[tuple[Any, Any]]) -> dict[Any, Any]:
    """What readers take the last of without a word."""
    content: dict[Any, Any] = {}
    for key, value in pairs:
        if not isinstance(key, str):
            raise ValueError(f"the field {key!r} is not text")
        if key in content:
            raise ValueError(f"the field {key!r} is there twice")
        content[key] = value
    return content


class _PlainLoader(yaml.SafeLoader):
    """Reads mappings by `_unique`, and no aliases: a few of them, one within another, stand for millions of entries."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError(f"an alias (*{self.peek_event().anchor}) is not read here")
        return super().compose_node(parent, index)


def _mapping(loader: _PlainLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    return _unique(loader.construct_pairs(node, deep=True))


_PlainLoader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _mapping)
