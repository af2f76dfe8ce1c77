"""Stores are whole or made anew, whatever lies in their place, in their journal or in the folder of their source."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motiongen.data.clips import Job, Sequence
from motiongen.data.journal import FEATURES_FILE, JOURNAL_FILE, Journal, journal_line
from motiongen.data.sources.bvh_folder import BvhFolder
from motiongen.data.sources.folder import MotionFolder
from motiongen.data.store import ClipStore, _row
from tests.compositions import skeleton
from tests.data.corpus import ListedSource
from tests.hostile.damage import damages
from tests.hostile.kept import SESSIONS, index, is_whole, signed, store_files
from tests.hostile.motions import POSES, bvh, is_motion
from tests.hostile.reader import EXAMPLES, NPZ, Reader, often, outcome
from tests.hostile.structures import changes

PLACE = "listed-0123456789abcdef"
fewer = settings(often, max_examples=max(1, EXAMPLES // 4))
SOURCE = ListedSource(SESSIONS, frozenset({"walk"}))


class DividedSource(ListedSource):
    """Every sequence a part."""

    def jobs(self) -> list[Job]:
        return [Job(one.name, (), partial(self._read, one)) for one in self.listed]

    def _read(self, sequence: Sequence) -> list[Sequence]:
        return [sequence]


def reopened(files: dict[str, bytes], folder: Path, source: ListedSource) -> ClipStore:
    """The source's store, where a folder with these files lies in the place that `folder` names."""
    shutil.rmtree(folder.parent, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    store = ClipStore.open(source, folder.parents[1])
    left = sorted(path.name for path in folder.parent.iterdir() if path.is_dir())
    assert left == [PLACE]
    assert sorted(path.name for path in store.folder.iterdir()) == ["features.npy", "index.json"]
    return store


def files_of(store: ClipStore) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in store.folder.iterdir()}


@given(damage=damages(in_zip=False), file=st.sampled_from(["index.json", "features.npy"]))
@often
def test_a_store_of_which_anything_was_changed_is_made_anew(damage: Any, file: str, tmp_path: Path) -> None:
    whole = store_files()
    damaged = whole | {file: damage(whole[file])}
    store = reopened(damaged, tmp_path / "clips" / PLACE, SOURCE)
    if store.was_made:
        assert damaged != whole
        assert files_of(store) == whole
    else:  # at most spaces differ
        assert damaged["features.npy"] == whole["features.npy"]
        assert json.loads(damaged["index.json"]) == json.loads(whole["index.json"])


@given(change=changes(with_arrays=False))
@often
def test_an_index_that_a_stranger_wrote_gives_a_whole_store(change: Callable[[Any], Any], tmp_path: Path) -> None:
    store = reopened(store_files() | {"index.json": signed(change(index()))}, tmp_path / "clips" / PLACE, SOURCE)
    assert is_whole(store)
    assert store.fingerprint == SOURCE.fingerprint()


@cache
def unfinished() -> dict[str, bytes]:
    """What a process leaves that is killed after the first part, before the second is complete."""
    with TemporaryDirectory() as place:
        with Journal(Path(place), SOURCE.fingerprint(), [one.name for one in SESSIONS]) as journal:
            journal.append(SESSIONS[0].features.numpy().tobytes())
            journal.close_part(SESSIONS[0].name, [_row(SESSIONS[0])])
            journal.append(SESSIONS[1].features.numpy().tobytes()[:1000])
        return {path.name: path.read_bytes() for path in Path(place).iterdir()}


@given(damage=damages(in_zip=False), file=st.sampled_from([JOURNAL_FILE, FEATURES_FILE]))
@often
def test_a_damaged_journal_is_gone_on_with_to_the_same_store(damage: Any, file: str, tmp_path: Path) -> None:
    left = unfinished()
    store = reopened(
        left | {file: damage(left[file])},
        tmp_path / "clips" / f"{PLACE}.unfinished",
        DividedSource(SESSIONS, frozenset({"walk"})),
    )
    assert files_of(store) == store_files()


@given(change=changes(with_arrays=False))
@often
def test_a_journal_that_a_stranger_wrote_gives_a_whole_store(change: Callable[[Any], Any], tmp_path: Path) -> None:
    entries = [json.loads(line.partition(b" ")[2]) for line in unfinished()[JOURNAL_FILE].splitlines()]
    changed = change(entries)
    lines = [journal_line(entry) for entry in changed] if isinstance(changed, list) else []
    store = reopened(
        unfinished() | {JOURNAL_FILE: b"".join(lines)},
        tmp_path / "clips" / f"{PLACE}.unfinished",
        DividedSource(SESSIONS, frozenset({"walk"})),
    )
    assert is_whole(store)


def written_bvh(root: Path) -> None:
    (root / "walk").mkdir()
    (root / "walk" / "a.bvh").write_bytes(bvh(8))


def written_motions(root: Path) -> None:
    for name in ("a.npz", "b.npz"):
        (root / name).write_bytes(NPZ.write(POSES))
    (root / "labels.csv").write_text("file,tags\na.npz,walk\nb.npz,walk + wave\n")


def labelled(path: Path) -> ClipStore:
    return ClipStore.open(MotionFolder(root=str(path.parent), skeleton=skeleton()), path.parent / "cache")


def guessed(path: Path) -> ClipStore:
    return ClipStore.open(BvhFolder(root=str(path.parents[1])), path.parents[1] / "cache")


FOLDERS = {
    "bvh": Reader("walk/a.bvh", lambda: bvh(8), guessed, is_whole, around=written_bvh, also=("sequence walk/a",)),
    "poses": Reader("a.npz", lambda: POSES, labelled, is_whole, NPZ, around=written_motions),
    "labels": Reader(
        "labels.csv", lambda: b"file,tags\na.npz,walk\nb.npz,walk + wave\n", labelled, is_whole, around=written_motions
    ),
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", FOLDERS)
@given(data=st.data())
@fewer
def test_a_folder_of_motions_gives_a_whole_store_or_none(name: str, data: st.DataObject, tmp_path: Path) -> None:
    reader = FOLDERS[name]
    shutil.rmtree(tmp_path / "cache", ignore_errors=True)
    path = reader.prepare(tmp_path)
    path.write_bytes(data.draw(reader.damaged())())
    store, complaint = outcome(reader.read, path)
    clips = tmp_path / "cache" / "clips"
    left = [place.name for place in clips.iterdir() if place.is_dir()] if clips.exists() else []
    if complaint:
        assert any(known in complaint for known in (path.name, *reader.also))
        assert left == []
    else:
        assert left == [store.folder.name]
        assert all(is_motion(store.features(number)) for number in range(len(store.sequences)))
