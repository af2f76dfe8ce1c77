"""The 31 tags of BABEL-MAG (Neural Marionette, supplement, Table 1): how often they occur and what follows what."""

from __future__ import annotations

from collections import Counter
from functools import cache

import numpy as np

from motiongen.data.sources.builtin.curves import Array

COUNTS = {
    "walk": 1370, "walk backward": 160, "walk sideway": 105, "walk upward/downward": 272, "step": 536, "run": 198,
    "jump": 168, "turn": 1063, "sit down": 86, "stand up": 123, "using object": 227, "take something up": 375,
    "place something down": 261, "move something": 102, "throw": 143, "touch something": 301, "kick": 91, "punch": 69,
    "wave hand": 29, "stretch": 410, "crossing limbs": 33, "touch body part": 200, "using object and sit": 39,
    "step and touch body part": 54, "stand": 754, "bend": 149, "sit": 325,
}  # fmt: skip
"""Segments of every action in BABEL-MAG, 7643 in all. The two conjunctions are tags of their own there."""
PART_COUNTS = {"head movement": 199, "arm movement": 859, "waist movement": 30, "leg movement": 193}
"""Segments of BABEL-MAG that bear the tag of a part of the body beside that of a state."""
PARTS = {
    "stand": ("head movement", "arm movement", "waist movement", "leg movement"),
    "bend": ("head movement", "arm movement"),
    "sit": ("head movement", "arm movement", "waist movement", "leg movement"),
}
"""What may move in a state. A bent person keeps waist and legs as they are."""
ROOT_TAGS = frozenset({"walk", "walk backward", "walk sideway", "walk upward/downward", "step", "run", "jump"})
LEAST = 76
"""Rarer tags are made as if they had this many segments, 1% of all: an hour has too few of them to learn from."""
EDGE = "edge"
"""What is before the first and after the last action of a session."""
LENGTHS = range(5, 20)
"""Actions of a session, each as likely as the others; one more where the last goes up the stairs."""
STAIRS = "walk upward/downward"
CANDIDATES = 4
"""Sessions that are proposed for one that is performed."""

_STATES = "stand, bend"
_FEET = "walk, walk backward, walk sideway, run, step, turn, jump"
_OBJECTS = "using object, take something up, move something, touch something"
_FREE = "stretch, wave hand, crossing limbs, touch body part, step and touch body part"
_FIGHT = "kick, punch"
_ANY = f"{_STATES}, {_FEET}, {_OBJECTS}, {_FREE}, {_FIGHT}, sit down"
_CHAIR = "sit, using object and sit, stand up"
FOLLOWING = {
    EDGE: f"{_ANY}, {_CHAIR}",
    "walk": f"{_ANY}, walk upward/downward, throw, place something down",
    "walk backward": f"{_STATES}, walk, walk sideway, step, turn, jump, sit down, kick, punch, touch body part",
    "walk sideway": f"{_STATES}, walk, walk backward, step, turn, jump, {_OBJECTS}, place something down",
    "walk upward/downward": f"{_STATES}, walk, step, turn, touch something, take something up",
    "step": f"{_ANY}, throw, place something down",
    "run": f"{_STATES}, walk, step, turn, jump, kick, throw",
    "jump": f"{_STATES}, walk, run, step, turn, jump, stretch, kick, punch",
    "turn": f"{_ANY}, throw, place something down",
    "sit down": _CHAIR,
    "sit": _CHAIR,
    "using object and sit": "sit, stand up",
    "stand up": f"{_STATES}, walk, walk backward, step, turn, stretch, take something up, touch body part",
    "using object": f"{_STATES}, {_FEET}, {_OBJECTS}, place something down, touch body part, sit down",
    "take something up": f"{_STATES}, {_FEET}, using object, move something, throw, place something down, sit down",
    "place something down": f"{_STATES}, {_FEET}, {_OBJECTS}, {_FREE}, sit down",
    "move something": f"{_STATES}, {_FEET}, {_OBJECTS}, place something down, touch body part",
    "throw": f"{_STATES}, {_FEET}, take something up, wave hand, crossing limbs",
    "touch something": f"{_STATES}, {_FEET}, {_OBJECTS}, touch body part, crossing limbs, sit down",
    "kick": f"{_STATES}, {_FEET}, kick, punch, stretch",
    "punch": f"{_STATES}, {_FEET}, kick, stretch, touch body part",
    "wave hand": f"{_STATES}, {_FEET}, crossing limbs, touch body part, sit down",
    "stretch": f"{_ANY}",
    "crossing limbs": f"{_STATES}, {_FEET}, touch body part, wave hand, stretch",
    "touch body part": f"{_ANY}",
    "step and touch body part": f"{_STATES}, {_FEET}, touch something, touch body part, crossing limbs",
    "stand": f"{_ANY}",
    "bend": f"{_STATES}, {_FEET}, stretch, take something up, touch body part",
}
"""What may follow an action. A walk does not follow a walk, nor a run a run: they would be one. Stairs are entered from
a walk and come in pairs, up and at once down again; a chair is left by standing up."""
_GAITS = ("walk", "run")
NODES = (EDGE, *COUNTS)


def may_follow(before: str, after: str) -> bool:
    """Whether the table lets an action follow another one; `EDGE` is the session's beginning."""
    listed = after in FOLLOWING[before].split(", ")
    return listed and not (before == after and before in _GAITS)


@cache
def transitions() -> Array:
    """How likely every node is after every other, (28, 28) in the order of `NODES`, each row of sum 1.

    Nobody leaves a chair or the stairs at once and sessions end after 5 to 20 actions, so the first flow along the
    table's arrows misses `COUNTS`; what it misses them by corrects what is aimed at.
    """
    wanted = np.array([max(count, LEAST) / (2 if tag == STAIRS else 1) for tag, count in COUNTS.items()])
    wanted /= wanted.sum()
    aim = wanted
    for _ in range(60):
        table = _flow(np.concatenate([[1 / np.mean(LENGTHS)], aim]))
        aim = aim * np.sqrt(wanted / _expected(table))
    return table


def _flow(target: Array) -> Array:
    """Rows of sum 1, along which actions flow so that each occurs as often as `target` (28,) says.

    Of all such flows the one nearest to chance (iterative proportional fitting: Deming and Stephan 1940).
    """
    flow = np.array([[float(after == EDGE or may_follow(before, after)) for after in NODES] for before in NODES])
    flow[0, 0] = 0.0
    for _ in range(60):
        flow *= (target / flow.sum(axis=1))[:, None]
        flow *= target / flow.sum(axis=0)
    table: Array = flow / flow.sum(axis=1, keepdims=True)
    return table


def _expected(table: Array) -> Array:
    """Shares (27,) of the actions in sessions of `LENGTHS`."""
    onward = table[1:, 1:] / table[1:, 1:].sum(axis=1, keepdims=True)
    now = table[0, 1:] / table[0, 1:].sum()
    total = np.zeros(len(now))
    for place in range(max(LENGTHS)):
        total += now * np.mean([length > place for length in LENGTHS])
        now = now @ onward
    return total / total.sum()


class Draw:
    """Draws the tags of session after session, so that even rare tags come about as often as they should.

    Of every few sessions that chance proposes, the one is taken that brings the counts so far nearest to `shares`.
    Chance alone gives an hour in which three people sit down where sixteen should.
    """

    def __init__(self) -> None:
        self._counts = np.zeros(len(shares()))

    def __call__(self, generator: np.random.Generator) -> list[tuple[str, ...]]:
        """The tags of a session of 5 to 20 actions; a state bears those of the parts of the body that move in it."""
        length = int(generator.choice(LENGTHS))
        proposed = [_propose(generator, length) for _ in range(CANDIDATES)]
        counts = [self._counts + _counted(session) for session in proposed]
        best = min(range(CANDIDATES), key=lambda place: _misses(counts[place]))
        self._counts = counts[best]
        return proposed[best]


@cache
def shares() -> dict[str, float]:
    """How many of all actions bear each of the 31 tags."""
    total = sum(max(count, LEAST) for count in COUNTS.values())
    return {tag: max(count, LEAST) / total for tag, count in (COUNTS | PART_COUNTS).items()}


def _misses(counts: Array) -> float:
    """Pearson's chi-squared of the counts (31,) of all tags against their shares."""
    expected = counts[: len(COUNTS)].sum() * np.array(list(shares().values()))
    return float(((counts - expected) ** 2 / expected).sum())


def _counted(session: list[tuple[str, ...]]) -> Array:
    """Actions (31,) that bear each tag."""
    found = Counter(tag for tags in session for tag in tags)
    return np.array([float(found[tag]) for tag in shares()])


def _propose(generator: np.random.Generator, length: int) -> list[tuple[str, ...]]:
    table = transitions()[:, 1:].cumsum(axis=1)
    drawn: list[tuple[str, ...]] = []
    node = 0
    while len(drawn) < length:
        # A session ends when it is long enough, so what is left for its end goes to the actions.
        node = 1 + int(np.searchsorted(table[node], generator.random() * table[node, -1], side="right"))
        tag = NODES[node]
        parts = tuple(part for part in PARTS.get(tag, ()) if generator.random() < _part_share(part))
        drawn += [(tag, *parts)] * (2 if tag == STAIRS else 1)
    return drawn


@cache
def _part_share(part: str) -> float:
    """How often a part of the body moves in the states in which it may."""
    states = sum(COUNTS[state] for state, parts in PARTS.items() if part in parts)
    return max(PART_COUNTS[part], LEAST) / states
