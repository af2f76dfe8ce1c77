"""The built-in corpus as a data source."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from motiongen.data.clips import DataError, Divisible, Job, Sequence
from motiongen.data.sources.builtin.babel_mag import ROOT_TAGS
from motiongen.data.sources.builtin.body import MEAN
from motiongen.data.sources.builtin.repertoire import REPERTOIRES
from motiongen.data.sources.builtin.sessions import session
from motiongen.data.sources.builtin.subjects import cast
from motiongen.motion.skeleton import Skeleton
from motiongen.options import PositiveInt, Range

MOST_SPREAD = 0.1
"""Actions are written for people of whom nobody differs more from the mean."""
BLOCK = 120
"""Sessions that are made one after another, an hour of motion; blocks do not depend on each other."""


class BuiltinSource(Divisible):
    """Procedural human motion, made from a seed: no files, no licence.

    Args:
        sessions: continuous takes of about twelve actions each.
        repertoire: `basic` has 13 actions in nearly equal numbers; `babel_mag` the 31 tags of Neural Marionette's data,
            the common ones more often than the rare ones.
        subjects: people who perform them in turn.
        seed: the same settings give the same motion, bit for bit.
        body_spread: the share by which the longest and the shortest of them differ from the mean body, in stature and
            in the proportions of trunk, shoulders and arms. All motion is shown on the mean body.

    Raises:
        DataError: fewer than one session or subject, a negative seed, a spread of more than 0.1, or another repertoire.
    """

    name = "builtin"

    def __init__(
        self,
        *,
        sessions: PositiveInt = 72,
        subjects: PositiveInt = 12,
        seed: Annotated[int, Range(0)] = 0,
        repertoire: Literal["basic", "babel_mag"] = "basic",
        body_spread: Annotated[float, Range(0.0, MOST_SPREAD)] = 0.0,
    ) -> None:
        for field, value, least in (("sessions", sessions, 1), ("subjects", subjects, 1), ("seed", seed, 0)):
            if value < least:
                raise DataError(f"data.source.{field}: {value} is below {least}")
        if not 0 <= body_spread <= MOST_SPREAD:
            raise DataError(f"data.source.body_spread: {body_spread} is not between 0 and {MOST_SPREAD}")
        if repertoire not in REPERTOIRES:
            raise DataError(f"data.source.repertoire: {repertoire!r} is none of {', '.join(REPERTOIRES)}")
        self._sessions, self._subjects, self._seed = sessions, subjects, seed
        self._repertoire, self._body_spread = repertoire, body_spread
        self.root_tags = ROOT_TAGS if repertoire == "babel_mag" else ROOT_TAGS & {"walk", "run", "step", "jump"}

    def fingerprint(self) -> str:
        """Of the settings and of the code that turns them into motion."""
        settings = [self._sessions, self._subjects, self._seed, self._repertoire, self._body_spread]
        digest = hashlib.sha256(json.dumps(settings).encode())
        folder = Path(__file__).parent
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.relative_to(folder).as_posix().encode())
            digest.update(path.read_bytes())
        return digest.hexdigest()

    def skeleton(self) -> Skeleton:
        return MEAN.skeleton()

    def __len__(self) -> int:
        return self._sessions

    def jobs(self) -> list[Job]:
        """Blocks of sessions; in each of them, rare tags come about as often as they should."""
        return [
            Job(
                f"sessions from {first} on",
                (),
                partial(self._perform, range(first, min(first + BLOCK, self._sessions))),
            )
            for first in range(0, self._sessions, BLOCK)
        ]

    def _perform(self, block: range) -> Iterator[Sequence]:
        people, draw = cast(self._seed, self._subjects, self._body_spread), REPERTOIRES[self._repertoire]()
        for index in block:
            generator = np.random.default_rng([self._seed, 2, index])
            yield session(f"session_{index:03d}", people[index % len(people)], generator, draw)
