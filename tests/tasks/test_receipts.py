from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from motiongen.configuration import compose
from motiongen.tasks.receipts import Receipt

TOLD = ["20 clips", "It was prepared before: here"]


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "motions" / "walk").mkdir(parents=True)
    (tmp_path / "motions" / "walk" / "1.bvh").write_text("HIERARCHY")
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / "index.json").write_text("{}")
    return tmp_path


def receipt(place: Path, *more: str) -> Receipt:
    line = ["task=prepare", "data=bvh_folder", f"data.source.root={place / 'motions'}", f"cache={place / 'cache'}"]
    return Receipt.of(compose([*line, *more]))


def test_what_was_said_is_said_again(place: Path) -> None:
    assert receipt(place).report() is None
    receipt(place).keep(place / "store", TOLD)
    assert receipt(place).report() == TOLD


def add(place: Path) -> None:
    (place / "motions" / "walk" / "2.bvh").write_text("HIERARCHY")


def change(place: Path) -> None:
    path = place / "motions" / "walk" / "1.bvh"
    before = path.stat()
    path.write_text("HIERARCHX")
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns + 1))


def rename(place: Path) -> None:
    (place / "motions" / "walk").rename(place / "motions" / "run")


def damage_store(place: Path) -> None:
    (place / "store" / "index.json").write_text("{ }")


def remove_store(place: Path) -> None:
    (place / "store" / "index.json").unlink()
    (place / "store").rmdir()


@pytest.mark.parametrize("happens", [add, change, rename, damage_store, remove_store])
def test_nothing_is_said_where_files_changed(place: Path, happens) -> None:
    receipt(place).keep(place / "store", TOLD)
    happens(place)
    assert receipt(place).report() is None


def test_another_split_is_another_receipt(place: Path) -> None:
    receipt(place).keep(place / "store", TOLD)
    assert receipt(place, "data.split_seed=1").report() is None


@pytest.mark.parametrize("content", ["", "[]", "{", '{"source": 1}', "null", "\0"])
def test_a_damaged_receipt_counts_as_none(place: Path, content: str) -> None:
    own = receipt(place)
    own.keep(place / "store", TOLD)
    kept = json.loads(own.path.read_text())
    for field in kept:
        own.path.write_text(json.dumps({**kept, field: {"another": "form"}}))
        assert own.report() is None, field
    own.path.write_text(content)
    assert own.report() is None


def test_saying_it_again_loads_nothing_heavy(tmp_path: Path) -> None:
    """Of the built-in corpus, prepared for real; torch alone would take a second."""
    line = ["task=prepare", "data=builtin", "data.source.sessions=8", "tracker=none", f"cache={tmp_path / 'cache'}"]
    code = f"import sys; from motiongen.application import main; main({line}); print('torch' in sys.modules)"
    first, again = (
        subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=600, check=True
        ).stdout.splitlines()
        for _ in range(2)
    )
    assert first[-1] == "True"
    assert again[-1] == "False"
    assert again[-2].startswith("It was prepared before: ")
    assert again[0] == next(text for text in first if text.startswith("| "))
