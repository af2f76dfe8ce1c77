"""Timelines to motions by the command line and from Python, at `scale=smoke`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from motiongen import synthesize
from motiongen.errors import InputError
from tests.tasks.command import motiongen
from tests.tasks.untrained import untrained_run

TIMELINE = """
path: [[0, 0], [0, -1], [1, -1.5]]
actions:
  - {tags: walk, seconds: 2}
  - {tags: [wave_hand], seconds: 1}
  - {tags: walk, seconds: 1}
seed: 2
variants: 3
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("runs")
    run = untrained_run(place / "run", "marionette")
    summary = {"name": "marionette", "data": {"tags": torch.load(run / "generator.pt", weights_only=True)["tags"]}}
    (run / "summary.json").write_text(json.dumps(summary))
    (place / "mine.yaml").write_text(TIMELINE)
    return place


def features(path: Path) -> np.ndarray:
    return np.load(path, allow_pickle=False)["features"]


def test_variants_of_a_document_in_order_and_the_same_from_python(place: Path) -> None:
    answer = motiongen(
        place,
        *("task=synthesize", "run=run", "timeline=mine.yaml", "rank=true", "correction=action_revision"),
        *("formats=[bvh]", "hydra.run.dir=made", "tracker=none", "recognizer.training.epochs=1"),
    )
    assert answer.returncode == 0, answer.stderr
    made = place / "made"
    names = ("motion", "motion-2", "motion-3")
    assert all((made / f"{name}{suffix}").is_file() for name in names for suffix in (".npz", ".bvh"))
    motions = [features(made / f"{name}.npz") for name in names]
    assert [len(motion) for motion in motions] == [6 + 120] * 3
    assert not np.allclose(motions[0], motions[1])
    overrides = ["rank=true", "correction=action_revision", "tracker=none", f"cache={place / 'cache'}"]
    scenes = synthesize(place / "run", place / "mine.yaml", overrides=[*overrides, "recognizer.training.epochs=1"])
    for scene, motion in zip(scenes, motions, strict=True):
        np.testing.assert_allclose(scene.features.numpy(), motion, atol=1e-5)
        assert scene.title.startswith("Variant ")
        assert scene.trajectory is not None
    scores = [float(scene.title.split("(log-probability ")[1].split(")")[0]) for scene in scenes]
    assert scores == sorted(scores, reverse=True)


@pytest.mark.parametrize(
    ("timeline", "message"),
    [
        ("wlak 2 s", "unknown tag 'wlak'; did you mean 'walk'"),
        ("broken.yaml", "broken.yaml: actions[0]: has no field 'secnds'; did you mean 'seconds'"),
        ("fast.yaml", "fast.yaml: actions[0].path: 50.0 m in 1 s are 50.0 m/s, too fast for actions[0] (walk)"),
    ],
)
def test_a_bad_timeline_leaves_no_motion(place: Path, timeline: str, message: str) -> None:
    (place / "broken.yaml").write_text("actions: [{tags: walk, seconds: 2, secnds: 3}]")
    (place / "fast.yaml").write_text("actions: [{tags: walk, seconds: 1, path: [[0, 0], [0, 50]]}]")
    answer = motiongen(
        place, "task=synthesize", "run=run", f"timeline='{timeline}'", "hydra.run.dir=bad", "tracker=none"
    )
    assert answer.returncode == 1
    assert message in answer.stderr
    assert "Traceback" not in answer.stderr
    assert not list((place / "bad").glob("motion.*"))


def test_python_is_told_the_same(place: Path) -> None:
    with pytest.raises(InputError, match="unknown tag 'wlak'; did you mean 'walk'"):
        synthesize(place / "run", "wlak 2 s")
    with pytest.raises(InputError, match="is not the folder of a run"):
        synthesize(place / "nothing", "walk 2 s")
