from __future__ import annotations

import json
import sqlite3
from pathlib import Path

import numpy as np
from PIL import Image

from motiongen.data.datamodule import MotionData
from motiongen.data.sources.bvh_names import CONVENTIONS
from motiongen.data.statistics import ALL, statistics_of
from tests.data.corpus import ListedSource, session
from tests.data.sources.rigs import RigFile, body, motion
from tests.tasks.command import motiongen


def test_a_folder_of_bvh_is_prepared_once_and_recorded(tmp_path: Path) -> None:
    local, pelvis = motion(60)
    for tag in ("walk", "sit"):
        for number in range(6):
            RigFile(CONVENTIONS["mixamo"], unit=0.01).write(
                tmp_path / "motions" / tag / f"{number}.bvh", local, pelvis, body()
            )
    (tmp_path / "motions" / "sit" / "odd.bvh").write_text("HIERARCHY")
    line = ["task=prepare", "data=bvh_folder", "data.source.root=motions"]
    first = motiongen(tmp_path, *line)
    assert first.returncode == 0, first.stderr
    for said in (
        "13 of 13 parts are to be read, 13 files of",
        "0 files are missing",
        "12 sequences, 12 clips, 720 frames, 0.01 hours",
        "Split: 10 clips to train, 2 to test",
        "Quarantine: 1 damaged parts\n- sit/odd.bvh: ",
        "The mapping was guessed and written to",
    ):
        assert said in first.stdout
    (folder,) = (tmp_path / "runs" / "prepare-bvh_folder-small-s0").iterdir()
    picture = np.asarray(Image.open(folder / "clips.png"))
    assert (picture != 255).any(axis=-1).mean() > 0.5, "the picture is empty"
    assert "odd.bvh" in (folder / "data.md").read_text()
    summary = json.loads((folder / "summary.json").read_text())
    with sqlite3.connect(tmp_path / "mlflow.db") as database:
        ((name, digest),) = database.execute("select name, digest from datasets").fetchall()
    assert (name, digest) == ("bvh_folder", summary["data"]["fingerprint"][:36])

    again = motiongen(tmp_path, *line)
    assert again.returncode == 0, again.stderr
    assert "It was prepared before" in again.stdout
    assert "parts are to be read" not in again.stdout
    assert "Quarantine: 1 damaged parts\n- sit/odd.bvh: " in again.stdout


def test_counts_are_those_of_the_corpus(tmp_path: Path) -> None:
    sessions = [
        session(f"s{number}", [(0, 30, "walk"), (30, 70, "wave,stand"), (70, 110, "walk")], 110) for number in range(6)
    ]
    sessions.append(session("long", [(0, 90, "stand"), (95, 98, "walk")], 100))
    found = statistics_of(MotionData(source=ListedSource(sessions), cache=str(tmp_path)))
    assert (found.sequences, found.frames, len(found.clips)) == (7, 760, 20)
    assert found.tags == ("stand", "walk", "wave")
    assert found.transitions.tolist() == [[0, 7, 0], [6, 0, 6], [0, 6, 0]]
    assert {tag: sorted(own) for tag, own in found.lengths.items()} == {
        "stand": [40] * 6 + [90],
        "walk": [3] + [30] * 6 + [40] * 6,
        "wave": [40] * 6,
    }
    assert found.used == found.train[ALL] + found.test[ALL] == 19
    walk = next(row for row in found.rows() if row["tag"] == "walk")
    assert (walk["clips"], walk["seconds, shortest"], walk["median"], walk["longest"]) == ("13", "0.1", "1.0", "1.3")
