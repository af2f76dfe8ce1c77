from __future__ import annotations

import pytest

from motiongen.data.sources.babel_mag import BODY_PARTS, CONJUNCTIONS, INTENTIONS, ROOT_TAGS, STATES, mag_tags

CASES = [
    ("walk", "walk", "Walk"),
    ("walk back", "walk|backwards movement", "Walk Backward"),
    ("walk sideways", "walk|sideways movement", "Walk Sideway"),
    ("side step", "step|sideways movement", "Walk Sideway"),
    ("walk up stairs", "walk|move up/down incline", "Walk Upward/Downward"),
    ("step forward", "step", "Step"),
    ("step up the stairs", "step", None),
    ("jog", "jog", "Run"),
    ("hop on one foot", "hop", "Jump"),
    ("turn around", "turn", "Turn"),
    ("turn head left", "turn|head movements", None),
    ("turn right hand", "turn", None),
    ("sit down", "sit", "Sit Down"),
    ("sitting back down", "sit", "Sit Down"),
    ("sit down with the help of both hands", "sit|interact with/use object", "Sit Down"),
    ("turn body to the left", "turn", "Turn"),
    ("sit on a chair", "sit", "Sit"),
    ("stand up", "stand up", "Stand Up"),
    ("use a phone", "interact with/use object", "Using Object"),
    ("pick up box", "take/pick something up", "Take Something Up"),
    ("grab handle", "grasp object", "Take Something Up"),
    ("place box", "place something", "Place Something Down"),
    ("walk to move a box", "move something|walk", "Move Something"),
    ("throw ball", "throw", "Throw"),
    ("touch wall", "touch object", "Touch Something"),
    ("kick", "kick|leg movements", "Kick"),
    ("punch", "punch", "Punch"),
    ("wave right hand", "wave|arm movements", "Wave Hand"),
    ("stretch", "stretch", "Stretch"),
    ("cross arms", "crossing limbs", "Crossing Limbs"),
    ("scratch nose", "touching face", "Touch Body Part"),
    ("type while sitting", "interact with/use object|sit", "Using Object and Sit"),
    ("step and touch knee", "step|touching body part", "Step and Touch Body Part"),
    ("stand", "stand", "Stand"),
    ("bend down", "bend", "Bend"),
    ("wiggle", "wiggle", None),
    ("transition", "transition", None),
]


@pytest.mark.parametrize(("words", "categories", "tag"), CASES)
def test_a_label_has_the_tag_of_its_intention_or_state(words: str, categories: str, tag: str | None) -> None:
    assert mag_tags([(words, frozenset(categories.split("|")))]) == (() if tag is None else (tag,))


def test_states_have_the_parts_of_the_body_that_move_beside_them() -> None:
    labels = [("stand", frozenset({"stand"})), ("raise hand, look left", frozenset({"hand movements", "look"}))]
    assert mag_tags(labels) == ("Stand", "Head Movement", "Arm Movement")
    assert mag_tags([("swing hips, lift foot", frozenset({"bend", "waist movements", "foot movements"}))]) == (
        *("Bend", "Waist Movement", "Leg Movement"),
    )
    assert mag_tags(labels[1:]) == ()


def test_the_goal_is_told_of_what_is_done_at_once() -> None:
    walk, wave = ("walk", frozenset({"walk"})), ("wave", frozenset({"wave"}))
    assert mag_tags([walk, wave]) == mag_tags([wave, walk]) == ("Wave Hand",)
    assert mag_tags([("sit", frozenset({"sit"})), ("call", frozenset({"interact with/use object"}))]) == (
        "Using Object and Sit",
    )


def test_there_are_the_paper_s_31_tags() -> None:
    tags = [rule.tag for rule in (*INTENTIONS, *STATES, *BODY_PARTS)] + list(CONJUNCTIONS)
    assert len(tags) == len(set(tags)) == 31
    assert set(tags) > ROOT_TAGS
    assert {tag for _, _, tag in CASES if tag} == set(tags) - {rule.tag for rule in BODY_PARTS}
