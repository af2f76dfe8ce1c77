"""What a store's `index.json` says, and what its journal says of a part; whoever reads either believes nothing."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from motiongen.data.clips import DataError, Segment, Side
from motiongen.documents import DocumentError, read_json
from motiongen.motion.skeleton import JOINTS

INDEX_FILE = "index.json"
FORMAT = 3
"""Counted up when the layout on disk changes."""
LARGEST = 2**30
"""Bytes of an index; that of BABEL has a hundredth of it."""
CHECKSUM = "checksum"
TEXTS = ("fingerprint", "sha256")


class DamagedStore(DataError):
    """A folder that is no store, or no longer one."""


@dataclass(frozen=True)
class StoredSequence:
    """What is known of a sequence without reading its frames."""

    name: str
    group: str
    length: int
    first: int
    """Its first row in the table of all frames."""
    segments: tuple[Segment, ...]
    side: Side | None
    """As in `Sequence`."""


def write_index(folder: Path, content: Mapping[str, Any]) -> None:
    """The index of a store, with a checksum of its own."""
    whole = {"format": FORMAT, **content}
    text = json.dumps(whole | {CHECKSUM: _checksum(whole)})
    (folder / INDEX_FILE).write_text(text, encoding="utf-8")


def read_index(folder: Path) -> tuple[dict[str, Any], tuple[StoredSequence, ...]]:
    """The fields of the index, each of the form that it was written in, and the sequences.

    Raises:
        DamagedStore: it is missing or damaged; the message names the field.
    """
    try:
        content = read_json(folder / INDEX_FILE, LARGEST, printable=False)
    except DocumentError as error:
        raise DamagedStore(f"{INDEX_FILE}: {error}") from error
    index: dict[str, Any] = content if isinstance(content, dict) else {}
    if index.get("format") != FORMAT:
        raise DamagedStore(f"{INDEX_FILE}: format is {index.get('format')!r:.100} instead of {FORMAT}")
    if index.pop(CHECKSUM, None) != _checksum(index):
        raise DamagedStore(f"{INDEX_FILE}: is not what was written")
    for field in TEXTS:
        _require(isinstance(index.get(field), str), field)
    _require(_is_skeleton(index.get("skeleton")), "skeleton")
    _require(_is_texts(index.get("root_tags")), "root_tags")
    # Stores of sources that have no parts need not have it.
    quarantine = index.setdefault("quarantine", {})
    _require(isinstance(quarantine, dict) and _is_texts(list(quarantine.values())), "quarantine")
    rows: Any = index.get("sequences")
    _require(isinstance(rows, list) and bool(rows), "sequences")
    sequences: list[StoredSequence] = []
    first = 0
    for row in rows:
        sequence = stored_sequence(row, first)
        _require(row.get("first") == first, f"sequences: {sequence.name!r:.100}: first")
        sequences.append(sequence)
        first += sequence.length
    _require(len({sequence.name for sequence in sequences}) == len(sequences), "sequences: name")
    return index, tuple(sequences)


def stored_sequence(row: Any, first: int) -> StoredSequence:
    """A sequence from its row in an index or a journal.

    Raises:
        DamagedStore: the row is not of the form in which it is written; the message names the field.
    """
    _require(isinstance(row, dict), "sequences")
    name, group, length, side = (row.get(field) for field in ("name", "group", "length", "side"))
    _require(isinstance(name, str), "sequences: name")
    where = f"sequences: {name!r:.100}"
    _require(isinstance(group, str), f"{where}: group")
    _require(type(length) is int and length > 0, f"{where}: length")
    _require(side is None or side in get_args(Side), f"{where}: side")
    items = row.get("segments")
    _require(isinstance(items, list), f"{where}: segments")
    segments = tuple(_segment(item, length, f"{where}: segments") for item in items)
    starts = [segment.start for segment in segments]
    _require(starts == sorted(starts), f"{where}: segments: start")
    return StoredSequence(name, group, length, first, segments, side)


def _segment(item: Any, length: int, where: str) -> Segment:
    _require(isinstance(item, dict), where)
    start, stop, tags, styles = (item.get(field) for field in ("start", "stop", "tags", "styles"))
    _require(type(start) is int and type(stop) is int and 0 <= start < stop <= length, f"{where}: start or stop")
    _require(_is_texts(tags) and bool(tags), f"{where}: tags")
    _require(_is_texts(styles), f"{where}: styles")
    return Segment(start, stop, tuple(tags), tuple(styles))


def _is_texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(text, str) for text in value)


def _is_skeleton(value: Any) -> bool:
    rows = value if isinstance(value, list) and all(isinstance(row, list) for row in value) else []
    numbers = [number for row in rows for number in row]
    return (
        [len(row) for row in rows] == [3] * JOINTS
        and all(type(number) in (int, float) for number in numbers)
        and all(-1e3 < number < 1e3 for number in numbers)
    )


def _require(holds: bool, field: str) -> None:
    if not holds:
        raise DamagedStore(f"{INDEX_FILE}: {field}: is missing, or not what was written")


def _checksum(index: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(index, sort_keys=True).encode()).hexdigest()
