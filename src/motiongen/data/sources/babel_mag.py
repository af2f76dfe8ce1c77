"""BABEL-MAG-auto: the 31 tags of Neural Marionette, by rule from BABEL's annotations.

The paper's relabelling by hand was not published. Its protocol (supplement, section 2) is followed by rule: an action
is tagged by its intention, the final goal before the way to it; one without an intention by the state of the body and
the parts that move. So every action has exactly one of the first 27 tags, and only states have body parts beside them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

Label = tuple[str, frozenset[str]]
"""BABEL's proc_label and act_cat."""


@dataclass(frozen=True)
class _Rule:
    """A label gets the tag if it has a category of every group, says the one pattern and does not say the other."""

    tag: str
    groups: tuple[frozenset[str], ...]
    says: re.Pattern[str] = re.compile("")
    says_not: re.Pattern[str] = re.compile("(?!)")

    def applies(self, label: Label) -> bool:
        words, categories = label
        if not all(group & categories for group in self.groups):
            return False
        return self.says.search(words) is not None and self.says_not.search(words) is None


def _rule(tag: str, *groups: str, says: str = "", says_not: str = "(?!)") -> _Rule:
    """Alternatives in a group are divided by `|`."""
    return _Rule(tag, tuple(frozenset(group.split("|")) for group in groups), re.compile(says), re.compile(says_not))


CONJUNCTIONS = {
    "Using Object and Sit": {"Using Object", "Sit"},
    "Step and Touch Body Part": {"Step", "Touch Body Part"},
}
"""Tags in place of two that are done at once."""
BODY_PART = r"\b(head|neck|face|torso|waist|hips?|arms?|hands?|wrists?|shoulders?|legs?|knees?|foot|feet)\b"
INTENTIONS = (
    # Goals.
    _rule("Sit Down", says=r"\bsit(s|ting)? (back )?down\b"),
    _rule("Stand Up", "stand up"),
    _rule("Take Something Up", "take/pick something up|lift something|grasp object"),
    _rule("Place Something Down", "place something"),
    _rule("Move Something", "move something"),
    _rule("Throw", "throw"),
    _rule("Kick", "kick"),
    _rule("Punch", "punch"),
    _rule("Wave Hand", "wave"),
    _rule("Crossing Limbs", "crossing limbs"),
    _rule("Touch Something", "touch object"),
    _rule("Touch Body Part", "touching body part|touching face"),
    _rule("Using Object", "interact with/use object"),
    _rule("Stretch", "stretch"),
    # Ways to move; the more special ones first.
    _rule("Jump", "jump|hop"),
    _rule("Run", "run|jog"),
    _rule("Walk Backward", "walk", "backwards movement"),
    _rule("Walk Sideway", "walk|step", "sideways movement"),
    _rule("Walk Upward/Downward", "move up/down incline"),
    _rule("Walk", "walk"),
    _rule("Turn", "turn", says_not=BODY_PART),
    _rule("Step", "step", says_not=r"\bstairs?\b"),
)
"""The first that applies tells the action."""
STATES = (_rule("Bend", "bend"), _rule("Sit", "sit"), _rule("Stand", "stand"))
"""The first that applies tells an action without an intention."""
BODY_PARTS = (
    _rule("Head Movement", "head movements|look"),
    _rule("Arm Movement", "arm movements|hand movements"),
    _rule("Waist Movement", "waist movements"),
    _rule("Leg Movement", "leg movements|foot movements|knee movement"),
)
ROOT_TAGS = frozenset({"Walk", "Walk Backward", "Walk Sideway", "Walk Upward/Downward", "Step", "Run", "Jump"})


def mag_tags(labels: Iterable[Label]) -> tuple[str, ...]:
    """The tags of what is done at once: one intention, or a state and the parts of the body that move; or none."""
    labels = tuple(labels)
    intentions, states, parts = (_tags(rules, labels) for rules in (INTENTIONS, STATES, BODY_PARTS))
    for tag, both in CONJUNCTIONS.items():
        if both & {*intentions[:1]} and both <= {*intentions, *states}:
            return (tag,)
    if intentions:
        return intentions[:1]
    return (*states[:1], *parts) if states else ()


def _tags(rules: tuple[_Rule, ...], labels: tuple[Label, ...]) -> tuple[str, ...]:
    return tuple(rule.tag for rule in rules if any(rule.applies(label) for label in labels))
