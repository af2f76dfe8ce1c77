"""A store in the making: frames that are appended, and a journal of the parts that are done.

A process may be killed at any time. Whoever goes on believes nothing but a journal line that has its checksum and whose
frames have theirs; what lies behind the last such line is cut off.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

import numpy as np

from motiongen.data.index import DamagedStore, stored_sequence
from motiongen.motion.representation import FEATURES

FEATURES_FILE = "features.npy"
JOURNAL_FILE = "journal.jsonl"
FRAME_BYTES = 4 * FEATURES
HEADER_BYTES = 128
"""NumPy pads headers, so that the count of rows can grow in place."""


class Journal:
    """Parts of a source on their way into a folder; a part is in it as a whole or not at all.

    Args:
        folder: made if it is not there.
        fingerprint: of the source; parts of another one are thrown away.
        parts: the names of the source's parts, in the order in which they come.
    """

    def __init__(self, folder: Path, fingerprint: str, parts: Sequence[str]) -> None:
        self._folder = folder
        self._fingerprint = fingerprint
        self._parts = parts
        self.done: dict[str, dict[str, Any]] = {}
        """By name of the part: its `sequences`, or the reason why it was `rejected`."""

    def __enter__(self) -> Self:
        self._folder.mkdir(exist_ok=True)
        # Made if it is not there, read from its start, and written at its end.
        self._frames: BinaryIO = os.fdopen(self._open(FEATURES_FILE), "r+b")
        self._lines: BinaryIO = os.fdopen(self._open(JOURNAL_FILE), "r+b")
        self._go_on()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._frames.close()
        self._lines.close()

    def _open(self, name: str) -> int:
        return os.open(self._folder / name, os.O_RDWR | os.O_CREAT, 0o666)

    def _go_on(self) -> None:
        kept = 0
        end = HEADER_BYTES
        size = self._frames.seek(0, os.SEEK_END)
        names: set[str] = set()
        for number, line in enumerate(self._lines):
            entry = _entry(line)
            if number == 0:
                if entry != {"fingerprint": self._fingerprint}:
                    break
            else:
                part = _part(entry, names)
                if part is None or [part.name] != self._parts[number - 1 : number]:
                    break
                # The last frames may not have come as far as the disk.
                if part.frames * FRAME_BYTES > size - end:
                    break
                self._frames.seek(end)
                if zlib.crc32(self._frames.read(part.frames * FRAME_BYTES)) != part.crc32:
                    break
                end += part.frames * FRAME_BYTES
                self.done[part.name] = part.outcome
            kept += len(line)
        self._lines.seek(kept)
        self._lines.truncate()
        if kept == 0:
            self._note({"fingerprint": self._fingerprint})
        self._start = end
        self.restart()

    @property
    def rejected(self) -> dict[str, str]:
        """Why parts were rejected, by their names."""
        return {name: entry["rejected"] for name, entry in self.done.items() if "rejected" in entry}

    def restart(self) -> None:
        """Begin the next part, or the same one again."""
        self._frames.seek(self._start)
        self._frames.truncate()
        self._crc32 = 0

    def append(self, frames: bytes) -> None:
        """Frames of the part that was begun."""
        self._frames.write(frames)
        self._crc32 = zlib.crc32(frames, self._crc32)

    def close_part(self, name: str, sequences: list[dict[str, Any]]) -> None:
        """The part is complete."""
        self._frames.flush()
        self._start = self._frames.tell()
        self._finish(name, {"sequences": sequences})

    def reject_part(self, name: str, reason: str) -> None:
        """The part is damaged; its frames are taken back."""
        self.restart()
        self._finish(name, {"rejected": reason})

    def _finish(self, name: str, outcome: dict[str, Any]) -> None:
        self.done[name] = outcome
        self._note({"name": name, "crc32": self._crc32} | outcome)
        self._crc32 = 0

    def _note(self, entry: dict[str, Any]) -> None:
        self._lines.write(journal_line(entry))
        self._lines.flush()

    def seal(self) -> None:
        """No more parts come: make the frames an array file. The journal still tells what is in it."""
        rows = (self._start - HEADER_BYTES) // FRAME_BYTES
        self._frames.seek(0)
        header = {"descr": "<f4", "fortran_order": False, "shape": (rows, FEATURES)}
        np.lib.format.write_array_header_1_0(self._frames, header)
        if self._frames.tell() != HEADER_BYTES:
            raise RuntimeError(f"NumPy's header has {self._frames.tell()} bytes, not {HEADER_BYTES}")
        self._frames.flush()


@dataclass(frozen=True)
class _Part:
    name: str
    frames: int
    crc32: int
    """Of its frames"""
    outcome: dict[str, Any]


def journal_line(entry: Mapping[str, Any]) -> bytes:
    """An entry with its checksum before it."""
    text = json.dumps(entry).encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)


def _entry(line: bytes) -> Any:
    """What a line says; None for one that is cut or damaged."""
    checksum, _, text = line.partition(b" ")
    try:
        # A checksum does not keep a stranger from writing what he likes.
        return json.loads(text) if line.endswith(b"\n") and int(checksum, 16) == zlib.crc32(text[:-1]) else None
    except (ValueError, RecursionError):
        return None


def _part(entry: Any, names: set[str]) -> _Part | None:
    """The part that an entry is about; None where it is of no such form.

    Args:
        entry: what a line says.
        names: of the sequences of parts before; its own are added.
    """
    fields: dict[str, Any] = entry if isinstance(entry, dict) else {}
    name, crc32 = fields.pop("name", None), fields.pop("crc32", None)
    if not isinstance(name, str) or type(crc32) is not int:
        return None
    if fields.keys() == {"rejected"} and isinstance(fields["rejected"], str):
        return _Part(name, 0, crc32, fields)
    if fields.keys() != {"sequences"} or not isinstance(fields["sequences"], list):
        return None
    try:
        sequences = [stored_sequence(row, 0) for row in fields["sequences"]]
    except DamagedStore:
        return None
    own = {sequence.name for sequence in sequences}
    if len(own) < len(sequences) or own & names:
        return None
    names |= own
    return _Part(name, sum(sequence.length for sequence in sequences), crc32, fields)
