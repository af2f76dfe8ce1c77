from __future__ import annotations

import json
import logging
import multiprocessing
import os
import pickle
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from motiongen.data.clips import DataError, Segment, Sequence
from motiongen.data.store import ClipStore, DamagedStore
from tests.data.corpus import ListedSource, session

SESSIONS = (
    session("one", [(0, 30, "walk"), (30, 70, "wave,stand")], 70),
    session("two", [(5, 20, "stand")], 25, group="pair"),
)
FORK = multiprocessing.get_context("fork")


class SlowSource(ListedSource):
    """Waits after its first sequence, and says so."""

    def __init__(self, started: multiprocessing.synchronize.Event, seconds: float, log: Path) -> None:
        super().__init__(SESSIONS, log=log)
        self._started = started
        self._seconds = seconds

    def sequences(self) -> Iterator[Sequence]:
        for sequence in super().sequences():
            yield sequence
            self._started.set()
            time.sleep(self._seconds)


def folder(cache: Path) -> Path:
    return cache / "clips" / "listed-0123456789abcdef"


def test_what_goes_in_comes_out(tmp_path: Path) -> None:
    store = ClipStore.open(ListedSource(SESSIONS, frozenset({"walk"})), tmp_path)
    assert store.tags == ("stand", "walk", "wave")
    assert store.root_tags == {"walk"}
    assert torch.equal(store.skeleton.offsets, ListedSource(SESSIONS).skeleton().offsets)
    for index, sequence in enumerate(SESSIONS):
        stored = store.sequences[index]
        assert (stored.name, stored.group, stored.length) == (sequence.name, sequence.group, len(sequence.features))
        assert stored.segments == sequence.segments
        assert torch.equal(store.features(index), sequence.features)
        assert torch.equal(store.features(index, 7, 19), sequence.features[7:19])


def test_a_copy_is_handed_out(tmp_path: Path) -> None:
    store = ClipStore.open(ListedSource(SESSIONS), tmp_path)
    store.features(0).zero_()
    assert torch.equal(store.features(0), SESSIONS[0].features)


@pytest.mark.parametrize("frames", [(-1, 3), (0, 71), (9, 8)])
def test_frames_of_a_neighbour_are_never_handed_out(tmp_path: Path, frames: tuple[int, int]) -> None:
    store = ClipStore.open(ListedSource(SESSIONS), tmp_path)
    with pytest.raises(IndexError, match="one, which has 70"):
        store.features(0, *frames)


def test_a_source_is_parsed_once(tmp_path: Path) -> None:
    source = ListedSource(SESSIONS, log=tmp_path / "log")
    for _ in range(3):
        ClipStore.open(source, tmp_path)
    assert len((tmp_path / "log").read_text().split()) == 1


def test_two_processes_that_prepare_at_once_make_one_store(tmp_path: Path) -> None:
    started = FORK.Event()

    def prepare() -> None:
        store = ClipStore.open(SlowSource(started, 0.3, tmp_path / "log"), tmp_path)
        os._exit(0 if torch.equal(store.features(1), SESSIONS[1].features) else 1)

    processes = [FORK.Process(target=prepare) for _ in range(2)]
    processes[0].start()
    assert started.wait(10)
    processes[1].start()
    for process in processes:
        process.join(20)
        assert process.exitcode == 0
    assert len((tmp_path / "log").read_text().split()) == 1
    assert sorted(path.name for path in folder(tmp_path).iterdir()) == ["features.npy", "index.json"]


def test_a_killed_preparation_is_not_taken_for_a_store(tmp_path: Path) -> None:
    started = FORK.Event()
    process = FORK.Process(target=lambda: ClipStore.open(SlowSource(started, 60, tmp_path / "log"), tmp_path))
    process.start()
    assert started.wait(10)
    os.kill(process.pid or 0, signal.SIGKILL)
    process.join(10)
    assert not folder(tmp_path).exists()
    assert [path for path in (tmp_path / "clips").iterdir() if path.is_dir()], "it was killed before it wrote anything"
    store = ClipStore.open(ListedSource(SESSIONS), tmp_path)
    assert torch.equal(store.features(1), SESSIONS[1].features)
    assert [path for path in (tmp_path / "clips").iterdir() if path.is_dir()] == [folder(tmp_path)]


def cut(path: Path) -> None:
    content = (path / "features.npy").read_bytes()
    (path / "features.npy").write_bytes(content[: len(content) // 2])


def flip(path: Path) -> None:
    content = bytearray((path / "features.npy").read_bytes())
    content[1000] ^= 1
    (path / "features.npy").write_bytes(content)


def lose(path: Path) -> None:
    (path / "features.npy").unlink()


def spoil_index(path: Path) -> None:
    (path / "index.json").write_text('{"format": 1, "sha')


def age(path: Path) -> None:
    index = json.loads((path / "index.json").read_text())
    (path / "index.json").write_text(json.dumps(index | {"format": 0}))


def rename_checksum(path: Path) -> None:
    text = (path / "index.json").read_text()
    (path / "index.json").write_text(text.replace("checksum", "checkrum"))


@pytest.mark.parametrize("damage", [cut, flip, lose, spoil_index, age, rename_checksum])
def test_a_damaged_store_is_noticed_and_made_anew(
    tmp_path: Path, damage: object, caplog: pytest.LogCaptureFixture
) -> None:
    assert callable(damage)
    ClipStore.open(ListedSource(SESSIONS), tmp_path)
    damage(folder(tmp_path))
    with pytest.raises(DamagedStore):
        ClipStore(folder(tmp_path))
    with caplog.at_level(logging.WARNING):
        store = ClipStore.open(ListedSource(SESSIONS), tmp_path)
    assert torch.equal(store.features(0), SESSIONS[0].features)
    assert "is damaged" in caplog.text


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        ({"name": "one"}, "name: used twice"),
        ({"features": torch.zeros(25, 134)}, r"features: torch.float32 \(25, 134\)"),
        ({"features": torch.zeros(25, 135).double()}, "features: torch.float64"),
        ({"features": torch.full((25, 135), torch.nan)}, "features: not finite at frame 0"),
        ({"segments": (Segment(5, 26, ("stand",)),)}, "segments: .* in 25 frames"),
        ({"segments": (Segment(5, 5, ("stand",)),)}, "segments: "),
        ({"segments": (Segment(5, 9, ()),)}, "segments: "),
        ({"segments": (Segment(5, 9, ("a",)), Segment(2, 4, ("a",)))}, "segments: not in time order"),
    ],
)
def test_a_source_that_breaks_its_promise_leaves_nothing_behind(
    tmp_path: Path, changed: dict[str, object], complaint: str
) -> None:
    broken = replace(SESSIONS[1], **changed)  # type: ignore[arg-type]
    with pytest.raises(DataError, match=rf"listed: sequence {broken.name}: {complaint}"):
        ClipStore.open(ListedSource([SESSIONS[0], broken]), tmp_path)
    assert [path for path in (tmp_path / "clips").iterdir() if path.is_dir()] == []


def test_an_empty_source_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="listed: no sequences"):
        ClipStore.open(ListedSource([]), tmp_path)


def test_a_process_that_gets_a_store_does_not_get_its_frames(tmp_path: Path) -> None:
    store = ClipStore.open(ListedSource([session("long", [(0, 9000, "walk")], 9000)]), tmp_path)
    sent = pickle.dumps(store)
    assert len(sent) < 10_000
    assert torch.equal(pickle.loads(sent).features(0), store.features(0))
