"""Make docs/images/orientation.png: a body of heading zero between the axes of our world and those of bvh and glb.

python tools/make_orientation.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import roma
import torch
from PIL import Image, ImageDraw, ImageFont

from motiongen.export.rasterizer import Camera, draw_mesh, draw_shadow, floor, to_image
from motiongen.export.scene import outfit
from motiongen.motion.bodies import makehuman
from motiongen.motion.skeleton import JOINTS

SIZE = (560, 560)
SCALE = 2
ORIGIN = np.zeros(3, np.float32)
COLORS = {"x": "#dc2626", "y": "#15803d", "z": "#1d4ed8"}
LEFT, UP, FORWARD = np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), np.array([0, -1.0, 0])
WORLDS = {
    "features, csv, amass: z up, facing -y": {"x": LEFT, "y": -FORWARD, "z": UP},
    "bvh, glb: y up, facing z": {"x": LEFT, "y": UP, "z": FORWARD},
}
"""Title to the direction of each axis, in our world."""


def picture(title: str, axes: dict[str, np.ndarray]) -> Image.Image:
    body = makehuman()
    rotations = torch.eye(3).repeat(1, JOINTS, 1, 1)
    rotations[:, 0] = roma.rotvec_to_rotmat(torch.tensor([np.pi / 2, 0.0, 0.0]))
    vertices = body.vertices(rotations, torch.zeros(1, 3))[0].numpy()
    vertices[:, 2] -= vertices[:, 2].min()
    width, height = (SCALE * side for side in SIZE)
    middle, view = np.array([0, 0, 0.85]), np.radians(30)
    camera = Camera.looking(middle, np.radians(-28), np.radians(16), 5.6, view, (width, height))
    canvas = floor(camera, np.zeros(2), 5.0, SCALE)
    draw_shadow(canvas, camera, vertices, body.faces.numpy())
    draw_mesh(canvas, camera, vertices, body.faces.numpy(), outfit(body).numpy())
    image = to_image(canvas)
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(SCALE * 22)
    for name, direction in axes.items():
        tip = (0.95 * direction if direction[2] == 0 else 1.9 * direction).astype(np.float32)
        (start, end), _ = camera.project(np.stack([ORIGIN, tip]))
        draw.line([*map(float, start), *map(float, end)], fill=COLORS[name], width=3 * SCALE)
        along = (end - start) / np.linalg.norm(end - start)
        side = np.array([-along[1], along[0]])
        corners = [end + 12 * SCALE * along, end + 6 * SCALE * side, end - 6 * SCALE * side]
        draw.polygon([tuple(map(float, corner)) for corner in corners], fill=COLORS[name])
        draw.text(tuple(end + 26 * SCALE * along), name, fill=COLORS[name], font=font, anchor="mm")
    draw.text(
        (width / 2, height - 18 * SCALE), title, fill="#1f2937", font=ImageFont.load_default(SCALE * 16), anchor="mm"
    )
    return image.reduce(SCALE)


def main() -> None:
    """Both worlds side by side."""
    both = Image.new("RGB", (2 * SIZE[0], SIZE[1]))
    for place, (title, axes) in enumerate(WORLDS.items()):
        both.paste(picture(title, axes), (place * SIZE[0], 0))
    both.save(Path(__file__).parents[1] / "docs" / "images" / "orientation.png")


if __name__ == "__main__":
    main()
