"""Preparing a data set in parts: damaged ones are left out, and what was done is not done again."""

from __future__ import annotations

import json
import multiprocessing
import os
import pickle
import signal
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from motiongen.data.clips import DataError, Divisible, Job, Sequence
from motiongen.data.journal import JOURNAL_FILE, journal_line
from motiongen.data.reading import LostReader, readings
from motiongen.data.sources.builtin.source import BuiltinSource
from motiongen.data.sources.smpl_folder import SmplFolder
from motiongen.data.store import ClipStore
from tests.data.corpus import ListedSource, session
from tests.data.sources.miniatures import smpl_corpus

SESSIONS = [session(f"s{number}", [(0, 20 + number, "walk")], 20 + number) for number in range(10)]
FORK = multiprocessing.get_context("fork")


class DivisibleSource(ListedSource):
    """Every sequence a part; `spoilt` ones are damaged, after their first frames were delivered if `late`. The process
    that reads is killed at one, and has a fault at another."""

    def __init__(
        self, *, log: Path, spoilt: tuple[str, ...] = (), dies_at: str = "", fails_at: str = "", late: bool = False
    ) -> None:
        super().__init__(SESSIONS, log=log)
        self._spoilt, self._dies_at, self._fails_at, self._late = spoilt, dies_at, fails_at, late

    def jobs(self) -> list[Job]:
        return [Job(one.name, (), partial(self._read, one)) for one in self.listed]

    def _read(self, sequence: Sequence) -> Iterator[Sequence]:
        assert self.log is not None
        with self.log.open("a") as file:
            file.write(f"{sequence.name}\n")
        if sequence.name == self._dies_at:
            os.kill(os.getpid(), signal.SIGKILL)
        if sequence.name == self._fails_at:
            raise RuntimeError("a fault of the parser")
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
    _, _, rest = journal.read_bytes().partition(b"\n")
    journal.write_bytes(journal_line({"fingerprint": ListedSource(SESSIONS).fingerprint() + "0"}) + rest)
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


@pytest.mark.parametrize("workers", [1, 2])
def test_processes_that_read_parts_give_the_same_bytes(tmp_path: Path, workers: int) -> None:
    late = DivisibleSource(log=tmp_path / "log", spoilt=("s3", "s7"), late=True)
    ClipStore.open(late, tmp_path / "one", workers=0)
    store = ClipStore.open(late, tmp_path / "several", workers=workers)
    assert same_bytes(tmp_path / "one", tmp_path / "several")
    assert store.quarantine == {"s3": "s3.bvh:7: is cut", "s7": "s7.bvh:7: is cut"}


def test_a_process_that_reads_and_is_killed_costs_no_part_that_is_done(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with pytest.raises(LostReader, match=r"data\.prepare_workers: .* was killed, .*goes on from there"):
        ClipStore.open(DivisibleSource(log=log, dies_at="s8"), tmp_path / "cache", workers=1)
    lines = (unfinished(tmp_path / "cache") / JOURNAL_FILE).read_text().splitlines()
    done = [json.loads(line.partition(" ")[2])["name"] for line in lines[1:]]
    assert done[:5] == ["s0", "s1", "s2", "s3", "s4"]
    log.unlink()
    ClipStore.open(DivisibleSource(log=log), tmp_path / "cache", workers=1)
    assert read(log) == [one.name for one in SESSIONS][len(done) :]
    ClipStore.open(DivisibleSource(log=log), tmp_path / "other")
    assert same_bytes(tmp_path / "cache", tmp_path / "other")


def test_a_fault_of_the_source_itself_is_not_taken_for_a_lost_process(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="a fault of the parser") as caught:
        ClipStore.open(DivisibleSource(log=tmp_path / "log", fails_at="s7"), tmp_path, workers=1)
    assert not isinstance(caught.value, LostReader)


@pytest.mark.parametrize(("threads", "processes", "seconds"), [(1, 1, 18.0), (2, 3, 9.0)])
def test_what_takes_long_is_read_by_as_many_processes_as_there_are_threads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, threads: int, processes: int, seconds: float
) -> None:
    pids, clock = tmp_path / "pids", [0.0]

    def read_slowly(sequence: Sequence) -> Iterator[Sequence]:
        with pids.open("a") as file:
            file.write(f"{os.getpid()}\n")
        clock[0] += 3.0
        yield sequence

    monkeypatch.setattr("motiongen.data.reading.time", SimpleNamespace(monotonic=lambda: clock[0]))
    monkeypatch.setattr(torch, "get_num_threads", lambda: threads)
    told: list[float] = []
    jobs = [Job(one.name, (), partial(read_slowly, one)) for one in SESSIONS]
    names = [next(iter(sequences)).name for _, sequences in readings(jobs, None, told.append)]
    assert names == [one.name for one in SESSIONS]
    # Four parts took more than ten seconds; the other six take as long each.
    assert told == [seconds]
    assert len(set(read(pids))) == processes


def test_parts_can_be_handed_to_processes_that_share_nothing(tmp_path: Path) -> None:
    """As on systems that cannot fork."""
    sources: list[Divisible] = [BuiltinSource(sessions=1), SmplFolder(root=str(smpl_corpus(tmp_path)))]
    for source in sources:
        job = source.jobs()[0]
        (again,) = pickle.loads(pickle.dumps(job)).read()
        (sequence,) = job.read()
        assert torch.equal(again.features, sequence.features)
