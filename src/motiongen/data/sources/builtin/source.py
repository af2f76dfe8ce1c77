"""The built-in corpus as a data source."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from motiongen.data.clips import DataError, Sequence
from motiongen.data.sources.builtin import body
from motiongen.data.sources.builtin.babel_mag import ROOT_TAGS
from motiongen.data.sources.builtin.repertoire import REPERTOIRES
from motiongen.data.sources.builtin.sessions import session
from motiongen.data.sources.builtin.subjects import cast
from motiongen.motion.skeleton import Skeleton
from motiongen.options import PositiveInt, Range


class BuiltinSource:
    """Procedural human motion, made from a seed: no files, no licence.

    Args:
        sessions: continuous takes of about twelve actions each.
        repertoire: `basic` has 13 actions in nearly equal numbers; `babel_mag` the 31 tags of Neural Marionette's data,
            the common ones more often than the rare ones.
        subjects: people who perform them in turn.
        seed: the same settings give the same motion, bit for bit.

    Raises:
        DataError: fewer than one session or subject, a negative seed, or another repertoire.
    """

    name = "builtin"

    def __init__(
        self,
        *,
        sessions: PositiveInt = 72,
        subjects: PositiveInt = 12,
        seed: Annotated[int, Range(0)] = 0,
        repertoire: Literal["basic", "babel_mag"] = "basic",
    ) -> None:
        for field, value, least in (("sessions", sessions, 1), ("subjects", subjects, 1), ("seed", seed, 0)):
            if value < least:
                raise DataError(f"data.source.{field}: {value} is below {least}")
        if repertoire not in REPERTOIRES:
            raise DataError(f"data.source.repertoire: {repertoire!r} is none of {', '.join(REPERTOIRES)}")
        self._sessions, self._subjects, self._seed = sessions, subjects, seed
        self._repertoire = repertoire
        self.root_tags = ROOT_TAGS if repertoire == "babel_mag" else ROOT_TAGS & {"walk", "run", "step", "jump"}

    def fingerprint(self) -> str:
        """Of the settings and of the code that turns them into motion."""
        digest = hashlib.sha256(json.dumps([self._sessions, self._subjects, self._seed, self._repertoire]).encode())
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
        people, draw = cast(self._seed, self._subjects), REPERTOIRES[self._repertoire]()
        for index in range(self._sessions):
            generator = np.random.default_rng([self._seed, 2, index])
            yield session(f"session_{index:03d}", people[index % len(people)], generator, draw)
