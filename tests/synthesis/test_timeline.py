from __future__ import annotations

import json

import pytest
from jsonschema import Draft202012Validator

from motiongen.synthesis.timeline import Action, Start, Timeline, TimelineError, read_timeline, resolve, schema

TAGS = ("raise-both-hands", "sit down", "walk", "wave hand")
WHOLE = """
seed: 3
variants: 2
style: happy
start: {file: pose.npz, frame: 4}
actions:
  - tags: walk
    seconds: 2
    path: [[0, 0], [0, -1.5], [1, -2]]
  - {tags: [walk, wave_hand], seconds: 1.5}
"""


def test_reads_tags_and_seconds():
    timeline = read_timeline("walk 2 s, sit down 1.5 s,wave hand 2")
    assert timeline.actions == (Action(("walk",), 2.0), Action(("sit down",), 1.5), Action(("wave hand",), 2.0))
    assert [action.frames for action in timeline.actions] == [60, 45, 60]
    assert timeline.title == "walk 2 s, sit down 1.5 s, wave hand 2 s"


def test_several_tags_at_once():
    assert read_timeline("walk + wave hand 2 s").actions == (Action(("walk", "wave hand"), 2.0),)


def test_tags_may_be_written_in_any_way():
    timeline = resolve(read_timeline("Walk 1, sit_down 1, raise both hands 1 s, wave-hand + walk 1"), TAGS)
    assert [action.label for action in timeline.actions] == ["walk", "sit down", "raise-both-hands", "wave hand + walk"]


def test_an_exact_tag_goes_before_one_that_differs_in_a_dash():
    timeline = resolve(read_timeline("wave_hand 1, wave-hand 1"), ("wave_hand", "wave-hand"))
    assert [action.tags[0] for action in timeline.actions] == ["wave_hand", "wave-hand"]


@pytest.mark.parametrize("suffix", ["yaml", "yml", "json"])
def test_a_document_says_all_there_is_to_say(tmp_path, suffix):
    (tmp_path / "pose.npz").touch()
    path = tmp_path / f"mine.{suffix}"
    content = {
        "actions": [
            {"tags": "walk", "seconds": 2, "path": [[0, 0], [0, -1.5], [1, -2]]},
            {"tags": ["walk", "wave_hand"], "seconds": 1.5},
        ],
        "seed": 3,
        "variants": 2,
        "style": "happy",
        "start": {"file": "pose.npz", "frame": 4},
    }
    path.write_text(json.dumps(content) if suffix == "json" else WHOLE)
    assert read_timeline(str(path)) == Timeline(
        actions=(
            Action(("walk",), 2.0, ((0.0, 0.0), (0.0, -1.5), (1.0, -2.0))),
            Action(("walk", "wave_hand"), 1.5),
        ),
        path=None,
        start=Start(file=tmp_path / "pose.npz", frame=4),
        style="happy",
        seed=3,
        variants=2,
        name=str(path),
    )


LINES = [
    ("walk", "'walk' is not of the form"),
    ("", "'' is not of the form"),
    ("walk 2 s,", "'' is not of the form"),
    ("walk -2 s", "unknown tag 'walk -'|is not of the form"),
    ("walk 0 s", "0 s is less than a frame"),
    ("walk 0.01 s", "0.01 s is less than a frame"),
    ("walk + 2 s", "there is no tag on one side of a [+]"),
    ("walk 9" + "9" * 400 + " s", "inf is not a duration"),
    ("wlak 2 s", r"actions\[0\].tags: unknown tag 'wlak'; did you mean 'walk'"),
    ("walk 1, fly 2 s", r"actions\[1\].tags: unknown tag 'fly'\n  tags: raise-both-hands, sit down, walk, wave hand"),
    ("walk + walk 2 s", "'walk' is there twice"),
    ("missing.yaml", "missing.yaml: cannot be read: No such file"),
]


@pytest.mark.parametrize(("text", "message"), LINES)
def test_errors_of_a_line_name_the_entry(text, message):
    with pytest.raises(TimelineError, match=message):
        resolve(read_timeline(text), TAGS)


WALK = "{tags: walk, seconds: 2}"
DOCUMENTS = [
    ("", "document: None is not a set of fields"),
    ("walk 2 s", "document: 'walk 2 s' is not a set of fields"),
    ("actions: [", "cannot be read as YAML"),
    ("{}", "document: the field 'actions' is missing"),
    ("actions: []", "actions: needs at least 1, and has 0"),
    ("actions: walk", "actions: 'walk' is not a list"),
    ("actions: [walk]", r"actions\[0\]: 'walk' is not a set of fields"),
    ("actions: [{tags: walk}]", r"actions\[0\]: the field 'seconds' is missing"),
    ("actions: [{seconds: 2}]", r"actions\[0\]: the field 'tags' is missing"),
    ("actions: [{tags: walk, secnds: 2}]", r"actions\[0\].*secnds|the field 'seconds' is missing"),
    ("actions: [{tags: walk, seconds: 2, pth: []}]", r"has no field 'pth'; did you mean 'path'"),
    ("actions: [{tags: walk, seconds: two}]", r"actions\[0\].seconds: 'two' is not a number"),
    ("actions: [{tags: walk, seconds: true}]", r"actions\[0\].seconds: True is not a number"),
    ("actions: [{tags: walk, seconds: 0}]", r"actions\[0\].seconds: 0 is not above 0"),
    ("actions: [{tags: walk, seconds: .inf}]", r"actions\[0\].seconds: inf is not a duration"),
    ("actions: [{tags: 3, seconds: 2}]", r"actions\[0\].tags: 3 is not text or a list"),
    ("actions: [{tags: [], seconds: 2}]", r"actions\[0\].tags: needs at least 1"),
    ("actions: [{tags: [walk, 3], seconds: 2}]", r"actions\[0\].tags\[1\]: 3 is not text"),
    ("actions: [{tags: wlak, seconds: 2}]", r"unknown tag 'wlak'; did you mean 'walk'"),
    ("actions: [{tags: walk, seconds: 2, path: [[0, 0]]}]", r"actions\[0\].path: needs at least 2, and has 1"),
    ("actions: [{tags: walk, seconds: 2, path: [[0, 0], [1]]}]", r"path\[1\]: needs at least 2"),
    ("actions: [{tags: walk, seconds: 2, path: [[0, 0], [1, 2, 3]]}]", r"path\[1\]: takes at most 2"),
    ("actions: [{tags: walk, seconds: 2, path: [[0, 0], [1, a]]}]", r"path\[1\]\[1\]: 'a' is not a number"),
    ("actions: [{tags: walk, seconds: 2, path: [[0, 0], [1, .nan]]}]", "a point that is not finite"),
    ("actions: [{tags: walk, seconds: 2, path: [[1, 1], [1, 1]]}]", "all its points are one"),
    (f"path: [[0, 0], [0, 0]]\nactions: [{WALK}]", "path: all its points are one"),
    (
        "path: [[0, 0], [0, 1]]\nactions: [{tags: walk, seconds: 2, path: [[0, 0], [0, 1]]}]",
        r"actions\[0\].path: the timeline has a path for all",
    ),
    (f"start: {{}}\nactions: [{WALK}]", "start: takes either a clip or a file"),
    (f"start: {{clip: a, file: b}}\nactions: [{WALK}]", "start: takes either a clip or a file"),
    (f"start: {{file: b.npz}}\nactions: [{WALK}]", "start.file: there is no file .*b.npz"),
    (f"start: {{clip: a, frame: -1}}\nactions: [{WALK}]", "start.frame: -1 is not at least 0"),
    (f"start: {{clip: a, frame: 1.5}}\nactions: [{WALK}]", "start.frame: 1.5 is not a whole number"),
    (f"seed: -1\nactions: [{WALK}]", "seed: -1 is not at least 0"),
    (f"variants: 0\nactions: [{WALK}]", "variants: 0 is not at least 1"),
    (f"variants: 1001\nactions: [{WALK}]", "variants: 1001 is more than 1000"),
    (f"actions: [{WALK}]\nactions: [{WALK}]", "the field 'actions' is there twice"),
    (f"actions: [{WALK}]\n1: 2", "the field 1 is not text"),
    (f"actions: [{WALK}]\nsed: 2", "document: has no field 'sed'; did you mean 'seed'"),
    ("!!python/object/apply:os.system [true]", "cannot be read as YAML"),
    ("&a [*a, *a]", "cannot be read as YAML|is not a set of fields"),
]


@pytest.mark.parametrize(("text", "message"), DOCUMENTS)
def test_errors_of_a_document_name_the_file_and_the_field(tmp_path, text, message):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(TimelineError, match=message) as caught:
        resolve(read_timeline(str(path)), TAGS)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'{"actions": [}', "cannot be read as JSON"),
        (b'{"seed": 1, "seed": 2}', "the field 'seed' is there twice"),
        (b"\xff\xfe", "not UTF-8 text"),
        (b" " * (2**20 + 1), "larger than 1048576 bytes"),
    ],
)
def test_damaged_json_is_told(tmp_path, content, message):
    path = tmp_path / "mine.json"
    path.write_bytes(content)
    with pytest.raises(TimelineError, match=message):
        read_timeline(str(path))


def test_a_folder_is_no_document(tmp_path):
    (tmp_path / "mine.yaml").mkdir()
    with pytest.raises(TimelineError, match=r"mine\.yaml: cannot be read: Is a directory"):
        read_timeline(str(tmp_path / "mine.yaml"))


def test_the_schema_is_one():
    Draft202012Validator.check_schema(schema())
