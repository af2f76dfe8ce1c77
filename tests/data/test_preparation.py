"""Preparing a data set in parts: damaged ones are left out, and what was done is not done again."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
import torch

from motiongen.data.clips import DataError, Job, Sequence
from motiongen.data.journal import JOURNAL_FILE
from motiongen.data.store import ClipStore
from tests.data.corpus import ListedSource, session

SESSIONS = [session(f"s{number}", [(0, 20 + number, "walk")], 20 + number) for number in range(10)]
FORK = multiprocessing.get_context("fork")


class DivisibleSource(ListedSource):
    """Every sequence a part; `spoilt` ones are damaged, after their first frames were delivered if `late`."""

    def __init__(self, *, log: Path, spoilt: tuple[str, ...] = (), dies_at: str = "", late: bool = False) -> None:
        super().__init__(SESSIONS, log=log)
        self._spoilt, self._dies_at, self._late = spoilt, dies_at, late

    def jobs(self) -> list[Job]:
        return [Job(one.name, (), partial(self._read, one)) for one in self.listed]

    def _read(self, sequence: Sequence) -> Iterator[Sequence]:
        assert self.log is not None
        with self.log.open("a") as file:
            file.write(f"{sequence.name}\n")
        if sequence.name == self._dies_at:
            os.kill(os.getpid(), signal.SIGKILL)
        if sequence.name in self._spoilt:
            if self._late:
                yield session("part of it", [(0, 9, "walk")], 9)
            raise DataError(f"{sequence.name}.bvh:7: is cut")
        yield sequence


def read(log: Path) -> list[str]:
    return log.read_text().split()


def stored(store: ClipStore) -> dict[str, torch.Tensor]:
    return {sequence.name: store.features(index) for index, sequence in enumerate(store.sequences)}


def killed_at(name: str, log: Path, cache: Path) -> None:
    process = FORK.Process(target=lambda: ClipStore.open(DivisibleSource(log=log, dies_at=name), cache))
    process.start()
    process.join(20)
    assert process.exitcode == -signal.SIGKILL


def unfinished(cache: Path) -> Path:
    return cache / "clips" / "listed-0123456789abcdef.unfinished"


def same_bytes(one: Path, other: Path) -> bool:
    place = Path("clips", "listed-0123456789abcdef")
    return all(
        (one / place / file).read_bytes() == (other / place / file).read_bytes()
        for file in ("features.npy", "index.json")
    )


@pytest.mark.parametrize("late", [False, True])
def test_damaged_parts_are_left_out_with_their_reason(tmp_path: Path, late: bool) -> None:
    source = DivisibleSource(log=tmp_path / "log", spoilt=("s3", "s7"), late=late)
    store = ClipStore.open(source, tmp_path)
    assert store.quarantine == {"s3": "s3.bvh:7: is cut", "s7": "s7.bvh:7: is cut"}
    assert set(stored(store)) == {one.name for one in SESSIONS} - {"s3", "s7"}
    assert all(torch.equal(stored(store)[one.name], one.features) for one in SESSIONS if one.name in stored(store))
    again = ClipStore.open(source, tmp_path)
    assert again.quarantine == store.quarantine
    assert (store.was_made, again.was_made) == (True, False)


def test_too_many_damaged_parts_are_an_error_that_leaves_nothing_behind(tmp_path: Path) -> None:
    source = DivisibleSource(log=tmp_path / "log", spoilt=("s3", "s5", "s7"))
    with pytest.raises(DataError, match=r"s3\.bvh:7: is cut\nlisted: 3 of 10 parts are damaged, .*max_rejected=0\.2"):
        ClipStore.open(source, tmp_path)
    assert read(tmp_path / "log")[-1] == "s7", "the rest was read although the outcome was certain"
    assert [path for path in (tmp_path / "clips").iterdir() if path.is_dir()] == []
    assert len(ClipStore.open(source, tmp_path, max_rejected=0.3).sequences) == 7


def test_a_source_of_which_nothing_is_left_is_an_error(tmp_path: Path) -> None:
    source = DivisibleSource(log=tmp_path / "log", spoilt=tuple(one.name for one in SESSIONS))
    with pytest.raises(DataError, match=r"s0\.bvh:7: is cut"):
        ClipStore.open(source, tmp_path, max_rejected=1.0)


def test_a_killed_preparation_goes_on_and_gives_the_same_bytes(tmp_path: Path) -> None:
    log = tmp_path / "log"
    killed_at("s4", log, tmp_path / "cache")
    killed_at("s8", log, tmp_path / "cache")
    store = ClipStore.open(DivisibleSource(log=log), tmp_path / "cache")
    names = [one.name for one in SESSIONS]
    assert read(log) == [*names[:5], *names[4:9], *names[8:]]
    assert list(stored(store)) == names
    ClipStore.open(DivisibleSource(log=log), tmp_path / "other")
    assert same_bytes(tmp_path / "cache", tmp_path / "other")
    assert not unfinished(tmp_path / "cache").exists()


def cut_frames(folder: Path) -> None:
    with (folder / "features.npy").open("r+b") as file:
        file.truncate(file.seek(0, os.SEEK_END) - 1)


def flip_frame(folder: Path) -> None:
    with (folder / "features.npy").open("r+b") as file:
        file.seek(-5, os.SEEK_END)
        file.write(b"\xff")


def cut_journal(folder: Path) -> None:
    path = folder / JOURNAL_FILE
    path.write_bytes(path.read_bytes()[:-9])


def add_garbage(folder: Path) -> None:
    with (folder / "features.npy").open("ab") as file:
        file.write(b"half a sequence")


@pytest.mark.parametrize(("damage", "reread"), [(cut_frames, 1), (flip_frame, 1), (cut_journal, 1), (add_garbage, 0)])
def test_only_parts_that_are_whole_are_believed(tmp_path: Path, damage: Callable[[Path], None], reread: int) -> None:
    log = tmp_path / "log"
    killed_at("s5", log, tmp_path / "cache")
    damage(unfinished(tmp_path / "cache"))
    log.unlink()
    ClipStore.open(DivisibleSource(log=log), tmp_path / "cache")
    assert read(log) == [one.name for one in SESSIONS][5 - reread :]
    ClipStore.open(DivisibleSource(log=log), tmp_path / "other")
    assert same_bytes(tmp_path / "cache", tmp_path / "other")


def test_parts_of_another_source_are_thrown_away(tmp_path: Path) -> None:
    log = tmp_path / "log"
    killed_at("s5", log, tmp_path)
    journal = unfinished(tmp_path) / JOURNAL_FILE
    first, _, rest = journal.read_text().partition("\n")
    journal.write_text(json.dumps({"fingerprint": json.loads(first)["fingerprint"] + "0"}) + "\n" + rest)
    log.unlink()
    store = ClipStore.open(DivisibleSource(log=log), tmp_path)
    assert len(read(log)) == 10
    assert list(stored(store)) == [one.name for one in SESSIONS]


def test_processes_read_one_store_at_once_each_with_one_file_open(tmp_path: Path) -> None:
    ClipStore.open(DivisibleSource(log=tmp_path / "log"), tmp_path)

    def files() -> int:
        return len(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").is_dir() else 0

    def reader() -> None:
        before = files()
        store = ClipStore.open(DivisibleSource(log=tmp_path / "log"), tmp_path)
        for _ in range(50):
            right = all(torch.equal(store.features(index), one.features) for index, one in enumerate(SESSIONS))
            if not right or files() > before + 1:
                os._exit(1)
        os._exit(0)

    processes = [FORK.Process(target=reader) for _ in range(4)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(30)
        assert process.exitcode == 0
    assert len(read(tmp_path / "log")) == 10, "a reader prepared it again"


def test_preparing_closes_what_it_opens(tmp_path: Path) -> None:
    before = len(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").is_dir() else 0
    for number in range(5):
        ClipStore.open(DivisibleSource(log=tmp_path / "log"), tmp_path / str(number))
    after = len(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").is_dir() else 0
    assert after <= before + 1
