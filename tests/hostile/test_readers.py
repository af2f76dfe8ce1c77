"""No file makes a reader fail in a way that was not promised, run anything, take memory without bound or stay half.

MOTIONGEN_FUZZ_EXAMPLES is how many files every reader gets, 60 by default; --hypothesis-show-statistics lists the
messages of each with their shares.
"""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from tests.data.sources.miniatures import Attack
from tests.hostile import data_sets, kept, motions, runs
from tests.hostile.reader import kind, often, outcome

READERS = motions.READERS | data_sets.READERS | kept.READERS | runs.READERS
NO_FORMAT = {
    "nothing": b"",
    "zeros": bytes(1000),
    "utf-16": b"\xff\xfe" + b"a" * 9,
    "brackets": b"[" * 10**5,
    "empty zip": b"PK\5\6" + bytes(18),
    "half a character": b'{"name": "\\ud800"}',
    "attack": pickle.dumps(Attack()),
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", READERS)
@given(data=st.data())
@often
def test_a_reader_delivers_what_is_right_or_says_what_is_wrong(name: str, data: st.DataObject, tmp_path: Path) -> None:
    reader = READERS[name]
    event(kind(reader.check(data.draw(reader.damaged())(), tmp_path), tmp_path))


@pytest.mark.parametrize("name", READERS)
def test_what_is_damaged_was_right_before(name: str, tmp_path: Path) -> None:
    reader = READERS[name]
    path = reader.prepare(tmp_path)
    path.write_bytes(reader.valid())
    found, complaint = outcome(reader.read, path)
    assert not complaint
    assert reader.is_right(found)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("content", NO_FORMAT)
def test_files_of_no_format_are_refused(
    name: str, content: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    READERS[name].check(NO_FORMAT[content], tmp_path)


@pytest.mark.parametrize("name", READERS)
def test_folders_and_absent_files_are_refused(name: str, tmp_path: Path) -> None:
    reader = READERS[name]
    path = reader.prepare(tmp_path)
    path.unlink(missing_ok=True)
    for place in (path, path.with_name("long" * 100 + path.name)):
        found, complaint = outcome(reader.read, place)
        assert path.name in complaint if complaint else reader.is_right(found)
    path.unlink(missing_ok=True)
    path.mkdir()
    found, complaint = outcome(reader.read, path)
    assert path.name in complaint if complaint else reader.is_right(found)
