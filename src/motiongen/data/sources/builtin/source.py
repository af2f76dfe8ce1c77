"""The built-in corpus as a data source."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np

from motiongen.data.clips import DataError, Sequence
from motiongen.data.sources.builtin import body
from motiongen.data.sources.builtin.sessions import session
from motiongen.data.sources.builtin.subjects import cast
from motiongen.motion.skeleton import Skeleton
from motiongen.options import PositiveInt, Range


class BuiltinSource:
    """Procedural human motion, made from a seed: no files, no licence.

    Args:
        sessions: continuous takes of about eleven actions each.
        subjects: people who perform them in turn.
        seed: the same settings give the same motion, bit for bit.

    Raises:
        DataError: fewer than one session or subject, or a negative seed.
    """

    name = "builtin"
    root_tags = frozenset({"walk", "run", "step", "jump"})

    def __init__(
        self, *, sessions: PositiveInt = 72, subjects: PositiveInt = 12, seed: Annotated[int, Range(0)] = 0
    ) -> None:
        for field, value, least in (("sessions", sessions, 1), ("subjects", subjects, 1), ("seed", seed, 0)):
            if value < least:
                raise DataError(f"data.source.{field}: {value} is below {least}")
        self._sessions, self._subjects, self._seed = sessions, subjects, seed

    def fingerprint(self) -> str:
        """Of the settings and of the code that turns them into motion."""
        digest = hashlib.sha256(json.dumps([self._sessions, self._subjects, self._seed]).encode())
        folder = Path(__file__).parent
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.relative_to(folder).as_posix().encode())
            digest.update(path.read_bytes())
        return digest.hexdigest()

    def skeleton(self) -> Skeleton:
        return body.skeleton()

    def __len__(self) -> int:
        return self._sessions

    def sequences(self) -> Iterator[Sequence]:
        people = cast(self._seed, self._subjects)
        for index in range(self._sessions):
            generator = np.random.default_rng([self._seed, 2, index])
            yield session(f"session_{index:03d}", people[index % len(people)], generator)
