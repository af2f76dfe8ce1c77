"""A store in the making: frames that are appended, and a journal of the parts that are done.

A process may be killed at any time. Whoever goes on believes nothing but a journal line whose frames have its checksum;
what lies behind the last such line is cut off.
"""

from __future__ import annotations

import json
import os
import zlib
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

import numpy as np

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
    """

    def __init__(self, folder: Path, fingerprint: str) -> None:
        self._folder = folder
        self._fingerprint = fingerprint
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
        self._frames.seek(end)
        for number, line in enumerate(self._lines):
            try:
                entry = json.loads(line)
                if number == 0:
                    if entry != {"fingerprint": self._fingerprint}:
                        break
                else:
                    size = FRAME_BYTES * sum(row["length"] for row in entry.get("sequences", ()))
                    if not line.endswith(b"\n") or zlib.crc32(self._frames.read(size)) != entry["crc32"]:
                        break
                    end += size
                    self.done[entry.pop("name")] = entry
            except (ValueError, KeyError, TypeError):
                break
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
        self._lines.write(json.dumps(entry).encode() + b"\n")
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
