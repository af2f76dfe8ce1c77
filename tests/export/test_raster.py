from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from motiongen.export.raster import render_gif, render_strip
from tests.export.motions import swinging


@pytest.mark.parametrize("travel", [0.0, 6.0])
def test_gif_plays_at_the_scenes_tempo_forever(tmp_path: Path, travel: float) -> None:
    path = tmp_path / "swing.gif"
    render_gif(path, swinging(travel=travel), size=160)
    with Image.open(path) as image:
        assert image.size == (160, 160)
        assert image.info["loop"] == 0
        assert image.n_frames == 6
        durations, pictures = [], []
        for frame in range(image.n_frames):
            image.seek(frame)
            durations.append(image.info["duration"])
            pictures.append(np.asarray(image.convert("RGB"), np.int64))
    assert sum(durations) == pytest.approx(1000 * 12 / 30, abs=10)
    # The body is there, inside the frame, and moves; the camera keeps it even when it walks away.
    for picture in pictures:
        dark = picture.sum(axis=-1) < 330
        assert dark.sum() > 300
        assert not dark[:2].any()
    assert all(np.abs(one - other).max() > 40 for one, other in pairwise(pictures))
    assert [path.name for path in tmp_path.iterdir()] == ["swing.gif"]


def test_long_motion_drops_frames_and_keeps_its_duration(tmp_path: Path) -> None:
    path = tmp_path / "long.gif"
    render_gif(path, swinging(frames=61), size=64, max_frames=8)
    with Image.open(path) as image:
        assert image.n_frames <= 8


def test_strip_shows_the_poses_side_by_side(tmp_path: Path) -> None:
    path = tmp_path / "strip.png"
    render_strip(path, swinging(travel=3.0), frames=4, height=160)
    with Image.open(path) as image:
        picture = np.asarray(image.convert("RGB"), np.int64)[34:194]
    assert picture.shape[1] > 2 * picture.shape[0]
    dark = (picture.sum(axis=-1) < 400).any(axis=0)
    starts = np.flatnonzero(np.diff(dark.astype(int)) == 1)
    assert len(starts) >= 4
    # Of four equal columns each has its pose.
    assert all(part.any() for part in np.array_split(dark, 4))


def test_the_same_scene_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        render_gif(tmp_path / f"{name}.gif", swinging(), size=64)
        render_strip(tmp_path / f"{name}.png", swinging(), frames=3, height=80)
    for suffix in (".gif", ".png"):
        assert (tmp_path / f"one{suffix}").read_bytes() == (tmp_path / f"two{suffix}").read_bytes()


def test_a_single_frame_is_a_scene_too(tmp_path: Path) -> None:
    scene = swinging(frames=12)
    still = type(scene)("still", scene.features[:1], scene.body)
    render_gif(tmp_path / "still.gif", still, size=64)
    render_strip(tmp_path / "still.png", still, height=80)
    assert len(list(tmp_path.iterdir())) == 2
