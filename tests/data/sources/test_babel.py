from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motiongen.data.clips import DataError, Sequence
from motiongen.data.sources.babel import Babel
from motiongen.data.splits import split
from motiongen.data.store import ClipStore
from motiongen.motion.kinematics import joint_positions
from tests.data.sources.miniatures import Known, amass, babel_corpus, entry, label, save_babel, save_npz

FOLDER = "BMLrub/BioMotionLab_NTroje/rub055"
PATH = f"{FOLDER}/walk_poses.npz"
PATH_OF_3 = "BMLrub/BioMotionLab_NTroje/rub001/3_poses.npz"


def recording(root: Path, place: str = PATH, seed: int = 0, frames: int = 241) -> None:
    """Of four seconds, at 60 Hz."""
    save_npz(root / "amass" / place, amass(Known(seed), frames, 60.0, np.zeros(3)))


def labelled(root: Path, one: dict[str, Any], **options: Any) -> list[tuple[int, int, tuple[str, ...]]]:
    """The segments of a single recording."""
    recording(root)
    (found,) = Babel(root=str(save_babel(root, train={"7": one})), **options).sequences()
    return [(segment.start, segment.stop, segment.tags) for segment in found.segments]


def test_motion_is_amass_s_and_labels_are_in_frames(tmp_path: Path) -> None:
    source = Babel(root=str(babel_corpus(tmp_path)))
    sequences = list(source.sequences())
    assert len(sequences) == len(source) == 8
    for number, sequence in enumerate(sequences):
        assert sequence.side == ("train" if number < 6 else "test")
        assert [(one.start, one.stop, one.tags) for one in sequence.segments] == [
            (0, 39, ("walk",)),
            (45, 81, ("kick",)),
            (81, 120, ("stand",)),
        ]
        found = joint_positions(sequence.features.double(), source.skeleton())
        assert len(found) == 120
        assert (found[..., 2].argmax(dim=1) != 0).all()


def test_frame_annotations_are_preferred_to_those_of_the_whole(tmp_path: Path) -> None:
    frame, whole = [label("run", ["run"], 1.0, 2.0)], [label("exercise", ["exercise/training"])]
    assert labelled(tmp_path, entry(PATH, 4.0, frame, whole)) == [(30, 60, ("run",))]
    assert labelled(tmp_path, entry(PATH, 4.0, None, whole)) == [(0, 120, ("exercise/training",))]


def test_labels_of_the_same_span_share_their_tags_and_a_part_has_those_of_the_whole(tmp_path: Path) -> None:
    labels = [
        label("wave", ["wave"], 1.0, 2.0),
        label("walk", ["walk", "forward movement"], 0.0, 2.5),
        label("turn", ["turn"], 2.0, 4.0),
        label("look", ["look"], 1.0, 2.001),
    ]
    assert labelled(tmp_path, entry(PATH, 4.0, labels)) == [
        (0, 75, ("forward movement", "walk")),
        (30, 60, ("forward movement", "look", "walk", "wave")),
        (60, 120, ("turn",)),
    ]


def test_transitions_and_labels_without_a_category_are_no_segments(tmp_path: Path) -> None:
    labels = [
        label("transition", ["transition"], 0.0, 1.0),
        label("walk to sit", ["walk", "transition"], 1.0, 2.0),
        label("something", None, 2.0, 3.0),
        label("stand", ["stand"], 3.0, 9.0),
        label("late", ["run"], 8.0, 9.0),
        label("instant", ["hop"], 3.5, 3.5),
    ]
    assert labelled(tmp_path, entry(PATH, 4.0, labels)) == [(30, 60, ("walk",)), (90, 121, ("stand",))]


@pytest.mark.parametrize(
    ("named", "place"),
    [
        (PATH, PATH),
        (PATH, "BioMotionLab_NTroje/rub055/walk_poses.npz"),
        (PATH, "BMLrub/rub055/walk_poses.npz"),
        (PATH, "BMLrub/rub055/walk_stageii.npz"),
        ("DFaust67/DFaust_67/50002/hips_poses.npz", "DFaust/50002/hips_poses.npz"),
        ("ACCAD/ACCAD/s007/kick_poses.npz", "ACCAD/s007/kick_poses.npz"),
    ],
)
def test_files_are_found_under_the_names_of_any_release(tmp_path: Path, named: str, place: str) -> None:
    recording(tmp_path, place)
    one = entry(named, 4.0, [label("walk", ["walk"], 0, 2)])
    (found,) = Babel(root=str(save_babel(tmp_path, train={"7": one}))).sequences()
    assert found.name == place


def test_amass_may_lie_elsewhere(tmp_path: Path) -> None:
    recording(tmp_path / "other")
    save_babel(tmp_path / "labels", train={"7": entry(PATH, 4.0, [label("walk", ["walk"], 0, 2)])})
    assert len(Babel(root=str(tmp_path / "labels"), amass=str(tmp_path / "other" / "amass"))) == 1


def test_missing_recordings_are_told_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    recording(tmp_path)
    entries = {
        str(number): entry(f"KIT/KIT/3/{number}_poses.npz", 4.0, [label("walk", ["walk"], 0, 2)]) for number in range(9)
    }
    with caplog.at_level(logging.WARNING):
        source = Babel(
            root=str(save_babel(tmp_path, train=entries, val={"x": entry(PATH, 4.0, None, [label("walk", ["walk"])])}))
        )
    assert len(source) == 1
    (message,) = caplog.messages
    assert "9 recordings that BABEL labels are missing: KIT/KIT/3/0_poses.npz" in message
    assert message.count("_poses.npz") == 5
    with pytest.raises(DataError, match=r"none of the 9 recordings .* data\.source\.amass="):
        Babel(root=str(save_babel(tmp_path, train=entries)))


def test_further_annotators_are_read_where_the_main_files_are_silent(tmp_path: Path) -> None:
    recording(tmp_path, "CMU/01/a_poses.npz")
    recording(tmp_path, "CMU/01/b_poses.npz", seed=1)

    def several(name: str, *words: str) -> dict[str, Any]:
        row = entry(f"CMU/01/{name}_poses.npz", 4.0, None)
        sequences = [{"labels": [label(word, [word])]} for word in words]
        return {key: row[key] for key in ("babel_sid", "url", "feat_p", "dur")} | {
            "seq_anns": sequences,
            "frame_anns": None,
        }

    main = entry("CMU/01/a_poses.npz", 4.0, [label("walk", ["walk"], 0, 2)])
    root = save_babel(
        tmp_path,
        train={"1": main},
        extra_train={"1": several("a", "run")},
        extra_val={"2": several("b", "jump", "run")},
    )
    first, second = Babel(root=str(root)).sequences()
    assert [(one.tags, first.side) for one in first.segments] == [(("walk",), "train")]
    assert [(one.tags, second.side) for one in second.segments] == [(("jump",), "test")]


def test_only_the_most_frequent_categories_are_kept(tmp_path: Path) -> None:
    recording(tmp_path)
    labels = [
        label(tag, [tag, "rare"][: 1 + (start == 0)], start, start + 1)
        for start, tag in enumerate(("a", "b", "a", "c"))
    ]
    root = save_babel(tmp_path, train={"1": entry(PATH, 4.0, labels)})
    source = Babel(root=str(root), most_frequent=2)
    (found,) = source.sequences()
    assert source.name == "babel_2"
    # `b`, `c` and `rare` are equally frequent; the alphabet decides.
    assert [segment.tags for segment in found.segments] == [("a",), ("b",), ("a",)]


def test_babel_mag_has_its_own_tags_and_a_split_that_is_drawn(tmp_path: Path) -> None:
    source = Babel(root=str(babel_corpus(tmp_path)), labels="mag", official_split=False)
    sequences: list[Sequence] = list(source.sequences())
    assert {sequence.side for sequence in sequences} == {None}
    assert [segment.tags for segment in sequences[0].segments] == [("Walk",), ("Kick",), ("Stand",)]
    assert {"Walk"} == source.root_tags & {"Walk", "Kick", "Stand"}


def test_val_is_the_test_split(tmp_path: Path) -> None:
    store = ClipStore.open(Babel(root=str(babel_corpus(tmp_path))), tmp_path / "cache")
    sides = [split(store, seed, test_share=0.5, test_cap=1) for seed in (0, 1)]
    assert sides[0] == sides[1]
    assert {clip.sequence for clip in sides[0].test} == {6, 7}
    assert {clip.sequence for clip in sides[0].train} == set(range(6))


def test_the_fingerprint_follows_labels_motion_and_options(tmp_path: Path) -> None:
    root = babel_corpus(tmp_path)
    first = Babel(root=str(root)).fingerprint()
    assert Babel(root=str(root)).fingerprint() == first
    assert Babel(root=str(root), official_split=False).fingerprint() != first
    recording(root, PATH_OF_3, seed=99)
    second = Babel(root=str(root)).fingerprint()
    assert second != first
    path = root / "babel_v1.0_release" / "val.json"
    path.write_text(path.read_text().replace('"kick"', '"jump"'))
    assert Babel(root=str(root)).fingerprint() not in (first, second)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"feat_p": None}, "7: .*"),
        ({"feat_p": "../../etc/passwd"}, r"7: feat_p: '../../etc/passwd' is not a path in AMASS's folder"),
        ({"feat_p": "/etc/passwd"}, r"7: feat_p: '/etc/passwd' is not a path"),
        ({"frame_ann": {"labels": [{"proc_label": "walk"}]}}, "7: KeyError: 'start_t'"),
        ({"frame_ann": {"labels": [label("walk", ["walk"], 0.0, "x")]}}, "7: TypeError"),  # type: ignore[arg-type]
        ({"frame_ann": {"labels": [label("walk", ["walk"], 0.0, float("nan"))]}}, "7: a label lasts from 0.0 to nan"),
        ({"frame_ann": {"nothing": 1}}, "7: KeyError: 'labels'"),
    ],
)
def test_a_wrong_entry_is_named(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    recording(tmp_path)
    one = entry(PATH, 4.0, [label("walk", ["walk"], 0, 2)]) | change
    with pytest.raises(DataError, match=rf"train\.json: {message}|none of the 1 recordings"):
        Babel(root=str(save_babel(tmp_path, train={"7": one})))


def test_missing_and_damaged_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"data\.source\.root: folder .*absent does not exist"):
        Babel(root=str(tmp_path / "absent"))
    with pytest.raises(DataError, match=r"babel_v1\.0_release/train\.json: the file is missing"):
        Babel(root=str(tmp_path))
    root = babel_corpus(tmp_path)
    (root / "babel_v1.0_release" / "val.json").write_text("{")
    with pytest.raises(DataError, match=r"val\.json: not a JSON file"):
        Babel(root=str(root))
    (root / "babel_v1.0_release" / "val.json").write_text(json.dumps([1]))
    with pytest.raises(DataError, match=r"val\.json: holds a list"):
        Babel(root=str(root))


def test_a_damaged_recording_is_left_out_with_the_reason(tmp_path: Path) -> None:
    root = babel_corpus(tmp_path)
    whole = Babel(root=str(root)).fingerprint()
    damaged = root / "amass" / PATH_OF_3
    damaged.write_bytes(damaged.read_bytes()[:5000])
    source = Babel(root=str(root))
    assert source.fingerprint() != whole
    store = ClipStore.open(source, tmp_path / "cache")
    assert len(store.sequences) == 7
    assert list(store.quarantine) == [PATH_OF_3]
    assert f"{damaged}: not an NPZ file" in store.quarantine[PATH_OF_3]
    with pytest.raises(DataError, match=r"3_poses\.npz: not an NPZ file.*\n.*data\.max_rejected=0\.1"):
        ClipStore.open(Babel(root=str(root)), tmp_path / "other", max_rejected=0.1)
    assert list((tmp_path / "other").glob("**/*.npy")) == []
