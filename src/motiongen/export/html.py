"""A page that plays motion in any browser: one file, no network, also inside MLflow's artifact view."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import roma
import torch
from numpy.typing import NDArray

from motiongen.export.scene import Scene, SceneError, outfit
from motiongen.files import replacing
from motiongen.motion.bodies.body import Body
from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import PARENTS

INT16 = 32767
INFLUENCES = 4


def write_page(path: Path, scenes: Sequence[Scene]) -> None:
    """Write one self-contained HTML file that plays the scenes; the same scenes give the same bytes.

    Bodies are skinned linearly in the browser with their four strongest weights; SMPL's pose blend shapes stay out.
    Rotations are rounded to 1/32767 of a quaternion's entry. Titles and labels are text, never markup.

    Raises:
        SceneError: no scenes.
    """
    if not scenes:
        raise SceneError("a page needs at least one scene")
    page = render_page(scenes)
    with replacing(path) as partial:
        partial.write_text(page, encoding="utf-8", newline="\n")


def render_page(scenes: Sequence[Scene]) -> str:
    """The page's source."""
    assets = files("motiongen.export") / "assets"
    viewer = (assets / "viewer.js").read_text(encoding="utf-8").strip()
    bodies: list[dict[str, Any]] = []
    used: list[int] = []
    known: dict[int, int] = {}
    for scene in scenes:
        # Scenes hold on to their bodies, so that an id stays one body's.
        if id(scene.body) not in known:
            packed = _pack_body(scene.body)
            if packed not in bodies:
                bodies.append(packed)
            known[id(scene.body)] = bodies.index(packed)
        used.append(known[id(scene.body)])
    data = {
        "bodies": bodies,
        "scenes": [_pack_scene(scene, body) for scene, body in zip(scenes, used, strict=True)],
    }
    title = scenes[0].title if len(scenes) == 1 else f"{scenes[0].title} and {len(scenes) - 1} more"
    parts = {
        "title": html.escape(title),
        "data": _inline_json(data),
        "viewer": viewer,
        # Only this script may run in the page, whatever a title holds.
        "viewer_hash": "sha256-" + base64.b64encode(hashlib.sha256(viewer.encode()).digest()).decode(),
    }
    template = (assets / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda slot: parts[slot[1]], template)


def _pack_body(body: Body) -> dict[str, Any]:
    body = body.to("cpu")
    values, joints = body.weights.topk(INFLUENCES, dim=1)
    shares = torch.round(255 * values / values.sum(dim=1, keepdim=True))
    shares[:, 0] += 255 - shares.sum(dim=1)
    return {
        "vertices": _scaled(body.rest),
        "faces": _packed(body.faces.numpy(), "uint16" if len(body.rest) <= 0xFFFF else "uint32"),
        "colors": _packed(torch.round(255 * outfit(body)).numpy(), "uint8"),
        "weight_joints": _packed(joints.numpy(), "uint8"),
        "weights": _packed(shares.numpy(), "uint8"),
        "offsets": _packed(body.skeleton.offsets.numpy(), "float32"),
        "parents": list(PARENTS),
    }


def _pack_scene(scene: Scene, body: int) -> dict[str, Any]:
    rotations, translation = unpack(scene.features.detach().cpu().float())
    quaternions = roma.rotmat_to_unitquat(rotations)
    path = scene.trajectory
    return {
        "title": scene.title,
        "body": body,
        "frames": scene.frames,
        "fps": scene.fps,
        "initial_frames": scene.initial_frames,
        "labels": [list(label) for label in scene.labels],
        "colors": {text: scene.color_of(text) for *_, text in scene.labels},
        "rotations": _packed(torch.round(quaternions * INT16).numpy(), "int16", 1 / INT16),
        "positions": _packed(translation.numpy(), "float32"),
        "trajectory": None if path is None else _packed(path.detach().cpu().numpy(), "float32"),
    }


def _scaled(values: torch.Tensor) -> dict[str, Any]:
    """As 16-bit integers of the largest magnitude: 0.03 mm for a body."""
    scale = float(values.abs().max()) / INT16
    return _packed(torch.round(values / scale).numpy(), "int16", scale)


def _packed(values: NDArray[Any], dtype: str, scale: float | None = None) -> dict[str, Any]:
    little = np.ascontiguousarray(values, dtype=np.dtype(dtype).newbyteorder("<"))
    packed: dict[str, Any] = {"dtype": dtype, "data": base64.b64encode(little.tobytes()).decode()}
    return packed if scale is None else packed | {"scale": scale}


def _inline_json(data: dict[str, Any]) -> str:
    """JSON that cannot end its script element or open a comment."""
    text = json.dumps(data, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
