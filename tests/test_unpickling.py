from __future__ import annotations

import os
import pickle
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pytest

from motiongen.unpickling import RefusedPickle, read_pickle

CONTENT = {
    "numbers": np.arange(12.0).reshape(3, 4),
    "columns": np.asfortranarray(np.arange(12, dtype=">i2").reshape(3, 4)),
    "none": np.zeros((0, 3), dtype=np.float32),
    "single": np.float32(2.5),
    "words": np.array(["walk", "run"]),
    "bytes": b"\x00\xff",
    1: [None, True, 3, -2.5, "año", ("a", {"b"}, frozenset({2}))],
}


def same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other)
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    return type(one) is type(other) and one == other


@pytest.mark.parametrize("protocol", range(6))
def test_a_pickle_is_read_as_python_reads_it(tmp_path: Path, protocol: int) -> None:
    content = CONTENT | {"clips": np.array([np.zeros(2), np.ones(3)], dtype=object)}
    path = tmp_path / "data.pkl"
    path.write_bytes(pickle.dumps(content, protocol=protocol))
    found = read_pickle(path)
    clips = found.pop("clips")
    assert [clip.tolist() for clip in clips] == [[0, 0], [1, 1, 1]]
    assert same(found, pickle.loads(pickle.dumps(CONTENT, protocol=protocol)))


@pytest.mark.parametrize("compress", [0, 3, ("zlib", 9)])
def test_a_joblib_file_is_read_as_joblib_reads_it(tmp_path: Path, compress: int | tuple[str, int]) -> None:
    joblib.dump(CONTENT, tmp_path / "data.joblib", compress=compress)
    found = read_pickle(tmp_path / "data.joblib")
    assert same(found, CONTENT)
    assert found["numbers"].flags.writeable


def test_an_array_that_is_stored_once_is_one_array(tmp_path: Path) -> None:
    array = np.ones(3)
    (tmp_path / "data.pkl").write_bytes(pickle.dumps([array, array]))
    one, other = read_pickle(tmp_path / "data.pkl")
    assert one is other


class Calls:
    """Unpickled by the standard library, this calls `function`."""

    def __init__(self, function: Any, *arguments: Any, state: Any = None) -> None:
        self.reduced = (function, arguments, state)

    def __reduce__(self) -> tuple[Any, ...]:
        return self.reduced


ATTACKS = {
    "system": (Calls(os.system, "touch attacked"), r"holds a posix\.system"),
    "eval": (Calls(eval, "open('attacked', 'w')"), r"holds a builtins\.eval"),
    "exec": (Calls(exec, "open('attacked', 'w')"), r"holds a builtins\.exec"),
    "class": (Path("x"), r"holds a pathlib\."),
    "load": (Calls(np.load, "attacked"), r"holds a numpy\.load"),
    "memory": (Calls(np.ndarray, (10**14,)), r"not callable"),
    "bytes": (Calls(bytes, 10**14), r"takes 0 positional arguments"),
    "pointers": (Calls(np.dtype, "V8", state=(3, "|", None, None, None, 8, 1, 63)), r"in a form that is not plain"),
    "attribute": (Calls(getattr, [], "__class__"), r"holds a builtins\.getattr"),
}


@pytest.mark.parametrize("attack", ATTACKS)
def test_nothing_but_data_is_read_and_nothing_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, attack: str
) -> None:
    monkeypatch.chdir(tmp_path)
    content, message = ATTACKS[attack]
    nested = {"poses": [np.zeros(3), content]}
    Path("plain.pkl").write_bytes(pickle.dumps(nested))
    joblib.dump(nested, "plain.joblib")
    joblib.dump(nested, "packed.joblib", compress=3)
    for name in ("plain.pkl", "plain.joblib", "packed.joblib"):
        with pytest.raises(RefusedPickle, match=rf"{name}: .*{message}"):
            read_pickle(Path(name))
    assert not Path("attacked").exists()


def test_objects_in_joblib_s_arrays_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """joblib puts them into a pickle of their own within the stream."""
    monkeypatch.chdir(tmp_path)
    joblib.dump(np.array([Calls(os.system, "touch attacked")], dtype=object), "data.joblib")
    with pytest.raises(RefusedPickle, match=r"holds an array of object"):
        read_pickle(Path("data.joblib"))
    assert not Path("attacked").exists()


def test_functions_keep_their_state(tmp_path: Path) -> None:
    """A BUILD that would set attributes of an admitted function: c = GLOBAL, } = empty dict, b = BUILD, . = STOP."""
    path = tmp_path / "data.pkl"
    path.write_bytes(b"cnumpy.core.multiarray\n_reconstruct\n}b.")
    with pytest.raises(RefusedPickle, match="sets the state of a function"):
        read_pickle(path)


@pytest.mark.parametrize("compress", [None, 0, 3])
def test_cut_files_are_refused(tmp_path: Path, compress: int | None) -> None:
    path = tmp_path / "data.pkl"
    if compress is None:
        path.write_bytes(pickle.dumps(CONTENT))
    else:
        joblib.dump(CONTENT, path, compress=compress)
    whole = path.read_bytes()
    for length in range(0, len(whole) - 1, 7):
        path.write_bytes(whole[:length])
        with pytest.raises(RefusedPickle, match=r"data\.pkl: "):
            read_pickle(path)


def test_large_files_are_refused_before_they_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motiongen.unpickling.LIMIT", 4000)
    joblib.dump(np.arange(10_000) % 7, tmp_path / "packed.joblib", compress=9)
    assert (tmp_path / "packed.joblib").stat().st_size < 4000
    joblib.dump(np.zeros(600), tmp_path / "plain.joblib")
    for name in ("packed.joblib", "plain.joblib"):
        with pytest.raises(RefusedPickle, match=rf"{name}: asks for .*more than 4000"):
            read_pickle(tmp_path / name)


def test_a_small_file_does_not_become_a_large_one(tmp_path: Path) -> None:
    joblib.dump(np.zeros(10**7), tmp_path / "packed.joblib", compress=9)
    packed = (tmp_path / "packed.joblib").stat().st_size
    assert packed < 10**6
    with pytest.raises(RefusedPickle, match=rf"packed\.joblib: asks for more than {200 * packed} bytes"):
        read_pickle(tmp_path / "packed.joblib")


def test_what_would_be_hashed_for_ever_is_refused(tmp_path: Path) -> None:
    """b = (a, a), c = (b, b), ...: few bytes, and each level takes twice as long."""
    path = tmp_path / "data.pkl"
    # ) = (), 2 = the same once more, \x86 = a tuple of two; } N s = a dictionary {key: None}, \x8f ( \x90 = a set.
    nested = b")" + 60 * b"2\x86"
    for content in (b"}" + nested + b"Ns.", b"\x8f(" + nested + b"\x90."):
        path.write_bytes(b"\x80\x04" + content)
        with pytest.raises(RefusedPickle, match=r"data\.pkl: has a tuple for a key or a member of a set"):
            read_pickle(path)


def test_other_compressions_are_refused(tmp_path: Path) -> None:
    joblib.dump(CONTENT, tmp_path / "data.joblib", compress=("gzip", 3))
    with pytest.raises(RefusedPickle, match=r"data\.joblib: not a readable pickle"):
        read_pickle(tmp_path / "data.joblib")
