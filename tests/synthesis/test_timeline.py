from __future__ import annotations

import pytest

from motiongen.synthesis.timeline import Action, TimelineError, parse_timeline

TAGS = ("sit down", "walk", "wave hand")


def test_reads_tags_and_seconds():
    actions = parse_timeline("walk 2 s, sit down 1.5 s,wave hand 2", TAGS)
    assert actions == (Action(("walk",), 2.0), Action(("sit down",), 1.5), Action(("wave hand",), 2.0))
    assert [action.frames(30) for action in actions] == [60, 45, 60]


def test_several_tags_at_once():
    assert parse_timeline("walk + wave hand 2 s", TAGS) == (Action(("walk", "wave hand"), 2.0),)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("walk", "'walk' is not of the form"),
        ("walk 2 s,", "'' is not of the form"),
        ("walk 0 s", "a duration is positive"),
        ("wlak 2 s", "unknown tag 'wlak'; did you mean 'walk'"),
        ("fly 2 s", "unknown tag 'fly'; known tags: sit down, walk, wave hand"),
    ],
)
def test_errors_name_the_entry(text, message):
    with pytest.raises(TimelineError, match=message):
        parse_timeline(text, TAGS)
