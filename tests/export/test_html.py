"""The page: what is embedded is the motion, text stays text, and a browser plays it."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import roma
import torch
from PIL import Image

from motiongen.export.html import write_page
from motiongen.export.scene import Scene, SceneError
from motiongen.motion.bodies import makehuman
from motiongen.motion.kinematics import global_rotations
from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import Skeleton
from tests.export.motions import swinging

HOSTILE = "</script><script>document.title='owned'</script><img src=x onerror=alert(1)> & <!-- {{viewer}}"

QUIET = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=480,420",
    "--virtual-time-budget=1000",
]


def embedded(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found
    return json.loads(found[1])  # type: ignore[no-any-return]


def unpacked(packed: dict[str, Any]) -> np.ndarray[Any, Any]:
    values = np.frombuffer(base64.b64decode(packed["data"]), np.dtype(packed["dtype"]).newbyteorder("<"))
    return values * packed.get("scale", 1)


def written(path: Path, scenes: list[Scene]) -> str:
    write_page(path, scenes)
    return path.read_text(encoding="utf-8")


def test_the_embedded_data_is_the_motion(tmp_path: Path) -> None:
    scene = swinging(travel=2.0)
    data = embedded(written(tmp_path / "page.html", [scene]))
    (shown,) = data["scenes"]
    rotations, translation = unpack(scene.features)
    quaternions = torch.from_numpy(unpacked(shown["rotations"]).reshape(12, 22, 4))
    torch.testing.assert_close(roma.unitquat_to_rotmat(quaternions).float(), rotations, atol=2e-4, rtol=0)
    np.testing.assert_array_equal(unpacked(shown["positions"]).reshape(12, 3), translation.numpy())
    assert scene.trajectory is not None
    np.testing.assert_array_equal(unpacked(shown["trajectory"]).reshape(12, 2), scene.trajectory.numpy())
    assert shown["labels"] == [[3, 8, "swing"], [8, 12, "stand"]]
    assert (shown["frames"], shown["fps"], shown["initial_frames"]) == (12, 30.0, 3)


def test_the_embedded_body_poses_like_the_body(tmp_path: Path) -> None:
    """What the browser does with the embedded arrays, done here, gives the body's own vertices."""
    scene = swinging()
    data = embedded(written(tmp_path / "page.html", [scene]))
    (body,) = data["bodies"]
    vertices = unpacked(body["vertices"]).reshape(-1, 3)
    offsets = unpacked(body["offsets"]).reshape(22, 3)
    joints = unpacked(body["weight_joints"]).reshape(-1, 4)
    weights = unpacked(body["weights"]).reshape(-1, 4) / 255
    np.testing.assert_array_equal(unpacked(body["faces"]).reshape(-1, 3), scene.body.faces.numpy())
    rotations, translation = unpack(scene.features[-1])
    world = global_rotations(rotations).double().numpy()
    rest, posed = np.zeros((22, 3)), np.zeros((22, 3))
    posed[0] = translation
    for joint, parent in enumerate(body["parents"][1:], start=1):
        rest[joint] = rest[parent] + offsets[joint]
        posed[joint] = posed[parent] + world[parent] @ offsets[joint]
    moved = np.einsum("vkab,vkb->vka", world[joints], vertices[:, None] - rest[joints]) + posed[joints]
    shown = (weights[..., None] * moved).sum(axis=1)
    expected = scene.body.vertices(rotations, translation).numpy()
    assert np.abs(shown - expected).max() < 2e-4


def test_scenes_share_a_body_and_differ_where_bodies_do(tmp_path: Path) -> None:
    scene = swinging()
    small = replace(scene, body=scene.body.fitted_to(Skeleton(0.5 * scene.body.skeleton.offsets)))
    data = embedded(written(tmp_path / "page.html", [scene, replace(scene, body=makehuman()), small, scene]))
    assert len(data["bodies"]) == 2
    assert [shown["body"] for shown in data["scenes"]] == [0, 0, 1, 0]


def test_text_stays_text(tmp_path: Path) -> None:
    scene = replace(swinging(title=HOSTILE), labels=((3, 12, HOSTILE),))
    page = written(tmp_path / "page.html", [scene])
    data = embedded(page)
    assert data["scenes"][0]["title"] == HOSTILE
    assert data["scenes"][0]["labels"] == [[3, 12, HOSTILE]]
    assert page.count("<script") == page.count("</script>") == 2
    assert "<img" not in page
    assert html.escape(HOSTILE) in page


def test_the_page_needs_nothing_from_outside_and_runs_only_its_own_script(tmp_path: Path) -> None:
    page = written(tmp_path / "page.html", [swinging()])
    assert not re.search(r'(?:src|href)\s*=\s*"', page.split("<script", maxsplit=1)[0])
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', page)
    assert policy
    assert "default-src 'none'" in policy[1]
    script = page.rsplit("<script>", maxsplit=1)[1].split("</script>", maxsplit=1)[0]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in policy[1]


def test_pages_are_small_and_repeatable(tmp_path: Path) -> None:
    scenes = [swinging(frames=300, title=f"motion {number}") for number in range(8)]
    first, second = written(tmp_path / "one.html", scenes), written(tmp_path / "two.html", scenes)
    assert first == second
    assert len(first) < 3_000_000
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.html", "two.html"]


def test_a_page_without_scenes_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="at least one scene"):
        write_page(tmp_path / "page.html", [])


def test_chromium_plays_the_page(tmp_path: Path) -> None:
    browser = os.environ.get("CHROME") or shutil.which("chromium")
    if browser is None:
        pytest.skip("no Chromium: neither the variable CHROME nor a program named chromium")
    page, picture = tmp_path / "page.html", tmp_path / "page.png"
    write_page(page, [swinging(title="first <b>motion</b>"), swinging(title="second")])
    command = [browser, *QUIET, f"--user-data-dir={tmp_path / 'profile'}"]
    command += ["--dump-dom", f"--screenshot={picture}", page.as_uri()]
    dom = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True).stdout
    assert "first &lt;b&gt;motion&lt;/b&gt;</h1>" in dom
    assert 'class="failure"' not in dom
    assert re.search(r'id="frame">frame \d+<', dom)
    assert dom.count('class="item"') == 2
    colors = np.asarray(Image.open(picture).convert("RGB"), np.int64).reshape(-1, 3)
    shirt = (colors[:, 2] > 120) & (colors[:, 2] - colors[:, 0] > 60)
    assert shirt.sum() > 300
