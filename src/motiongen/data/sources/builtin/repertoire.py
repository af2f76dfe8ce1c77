"""What is performed in a session: the tags, and the functions that act them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from motiongen.data.sources.builtin.actions import objects, pacing, selfcontact, states
from motiongen.data.sources.builtin.actions.footwork import step, turn
from motiongen.data.sources.builtin.actions.gestures import kick, punch, throw, wave_hand
from motiongen.data.sources.builtin.actions.posture import jump, sit, sit_down, stand, stand_up
from motiongen.data.sources.builtin.actor import Actor
from motiongen.data.sources.builtin.babel_mag import Draw

GAITS = ("walk", "run")
"""What shares one gait: neighbours become one stretch without a stop."""
SEATED = ("sit", "using object and sit", "stand up")
"""What begins on a chair."""
Perform = Callable[[Actor], None]


@dataclass(frozen=True)
class Act:
    """One action of a session."""

    tags: tuple[str, ...]
    perform: Perform | None
    """Nothing for `GAITS`."""


Repertoire = Callable[[np.random.Generator], list[Act]]
"""Draws the acts of the next session."""
_ACTIONS: dict[str, Perform] = {
    "step": step,
    "turn": turn,
    "sit down": sit_down,
    "sit": sit,
    "stand up": stand_up,
    "stand": stand,
    "jump": jump,
    "kick": kick,
    "punch": punch,
    "throw": throw,
    "wave hand": wave_hand,
}
"""Every tag of the 13 but walk and run."""
_PHRASES = (
    ("walk",), ("run",), ("step",), ("turn",), ("sit down", "sit", "stand up"), ("stand",), ("jump",), ("kick",),
    ("punch",), ("throw",), ("wave hand",),
)  # fmt: skip
_MORE: dict[str, Perform] = {
    "walk backward": pacing.walk_backward,
    "walk sideway": pacing.walk_sideway,
    "walk upward/downward": pacing.climb_or_descend,
    "using object": objects.use_object,
    "take something up": objects.take_something_up,
    "place something down": objects.place_something_down,
    "move something": objects.move_something,
    "touch something": objects.touch_something,
    "stretch": selfcontact.stretch,
    "crossing limbs": selfcontact.crossing_limbs,
    "touch body part": selfcontact.touch_body_part,
    "step and touch body part": selfcontact.step_and_touch_body_part,
    "using object and sit": states.use_object_and_sit,
}
_STATES = {"stand": states.stand_still, "bend": states.bend, "sit": states.sit_still}


def basic(generator: np.random.Generator) -> list[Act]:
    """13 tags. A shuffle of the phrases without one or two; half of the time walk and run follow each other."""
    kept = generator.permutation(len(_PHRASES))[: len(_PHRASES) - int(generator.integers(1, 3))]
    phrases = [_PHRASES[index] for index in kept]
    if generator.random() < 0.5 and ("walk",) in phrases and ("run",) in phrases:
        pair = [("walk",), ("run",)]
        rest = [phrase for phrase in phrases if phrase not in pair]
        place = int(generator.integers(0, len(rest) + 1))
        phrases = rest[:place] + [pair[index] for index in generator.permutation(2)] + rest[place:]
    return [Act((tag,), _ACTIONS.get(tag)) for phrase in phrases for tag in phrase]


def babel_mag() -> Repertoire:
    """31 tags: sessions of 5 to 20 actions along the table of transitions."""
    draw = Draw()

    def acts(generator: np.random.Generator) -> list[Act]:
        return [act(tags) for tags in draw(generator)]

    return acts


def act(tags: tuple[str, ...]) -> Act:
    """What performs one of the 31 tags, a state with the parts of the body that move in it."""
    tag, *parts = tags
    if tag in _STATES:
        return Act(tags, partial(_STATES[tag], parts=tuple(parts)))
    return Act(tags, (_MORE | _ACTIONS).get(tag))


REPERTOIRES: dict[str, Callable[[], Repertoire]] = {"basic": lambda: basic, "babel_mag": babel_mag}
"""Each makes what draws the sessions of a block, in order."""
