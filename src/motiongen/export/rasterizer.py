"""A small software renderer: a camera, shaded triangles with a depth order, a floor. No GPU and no display needed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFilter

Array = NDArray[np.float32]
Pixels = NDArray[np.float32]
"""(height, width, 3), 0..1"""

SKY = np.array([0.965, 0.970, 0.980], np.float32)
GROUND = np.array([0.895, 0.908, 0.930], np.float32)
LINE = np.array([0.795, 0.815, 0.855], np.float32)
SHADOW = np.array([0.50, 0.54, 0.63], np.float32)
SHADOW_SCALE = 4
"""Shadows are drawn at a quarter of the resolution: they are blurred anyway."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera in a z-up world; rows of `axes` are right, down and forward."""

    eye: Array
    axes: Array
    focal: float
    width: int
    height: int

    @classmethod
    def looking(
        cls, at: Array, azimuth: float, elevation: float, distance: float, view: float, size: tuple[int, int]
    ) -> Camera:
        """A camera at `distance` metres from a point. Angles in radians; azimuth 0 looks along +y; view is vertical."""
        forward = np.array([np.sin(azimuth), np.cos(azimuth), 0.0]) * np.cos(elevation) - [0, 0, np.sin(elevation)]
        right = np.array([np.cos(azimuth), -np.sin(azimuth), 0.0])
        axes = np.stack([right, np.cross(forward, right), forward]).astype(np.float32)
        width, height = size
        eye = (np.asarray(at) - distance * forward).astype(np.float32)
        return cls(eye, axes, height / 2 / float(np.tan(view / 2)), width, height)

    @property
    def light(self) -> Array:
        """Direction (3,) towards the key light: over the camera's left shoulder."""
        right, _, forward = self.axes
        level = forward * [1, 1, 0]
        direction = -0.55 * right - 0.65 * level / np.linalg.norm(level) + np.array([0, 0, 1.25])
        return (direction / np.linalg.norm(direction)).astype(np.float32)

    def project(self, points: Array) -> tuple[Array, Array]:
        """World points (..., 3) to pixels (..., 2) and depths (...) along the view, metres."""
        seen = (points - self.eye) @ self.axes.T
        depth = np.maximum(seen[..., 2], 1e-3)
        middle = np.array([self.width / 2, self.height / 2], np.float32)
        return (seen[..., :2] * (self.focal / depth[..., None]) + middle).astype(np.float32), depth


def normals_of(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Unit normals (V, 3), weighted by the area of the faces around each vertex."""
    corners = vertices[faces]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.empty_like(vertices)
    for axis in range(3):
        normals[:, axis] = np.bincount(faces.ravel(), np.repeat(crosses[:, axis], 3), len(vertices))
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def shade(vertices: Array, normals: Array, color: Array, camera: Camera) -> Array:
    """Lit vertex colors (V, 3) of a surface with `color` (V, 3) or (3,).

    A warm key light, a cool sky, a soft highlight and a bright rim.
    """
    view = camera.eye - vertices
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    light = camera.light
    key = np.clip((normals @ light + 0.25) / 1.25, 0, None)
    sky = 0.5 + 0.5 * normals[:, 2]
    half = view + light
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    gloss = np.clip((normals * half).sum(1), 0, 1) ** 24
    rim = (1 - np.clip((normals * view).sum(1), 0, 1)) ** 3
    lit = np.outer(key, [0.78, 0.75, 0.70]) + np.outer(sky, [0.28, 0.30, 0.36]) + 0.14
    return np.clip(color * lit + 0.10 * gloss[:, None] + 0.14 * (rim * sky)[:, None], 0, 1).astype(np.float32)


def cover(
    points: Array, faces: NDArray[np.int64], size: tuple[int, int]
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """The pixels whose centers lie inside triangles.

    Args:
        points: (V, 2) pixel positions.
        faces: (F, 3).
        size: width and height.

    Returns:
        Flat pixel indices (N,), the face of each (N,), and its barycentric coordinates there (N, 3).
    """
    width, height = size
    corners = points[faces]
    low = np.floor(corners.min(axis=1)).astype(np.int64)
    high = np.ceil(corners.max(axis=1)).astype(np.int64)
    extent = (high - low).max(axis=1)
    area = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    usable = (high > 0).all(axis=1) & (low < [width, height]).all(axis=1) & (np.abs(area) > 1e-9)
    found: list[tuple[NDArray[np.int64], NDArray[np.int64], Array]] = []
    # Triangles of about one size share a grid of candidate pixels.
    side, smallest = 2, 0
    while smallest < max(extent[usable], default=0):
        chosen = np.flatnonzero(usable & (extent > smallest) & (extent <= side))
        row, column = np.indices((side, side), dtype=np.float32).reshape(2, -1)
        for part in np.array_split(chosen, len(chosen) * side * side // 2_000_000 + 1):
            # Barycentric coordinates are affine in the pixel q:
            triangle = corners[part] - (low[part, None] + 0.5).astype(np.float32)
            # (a - q) x (b - q) = a x b + q_x (a_y - b_y) + q_y (b_x - a_x)
            edges = (np.roll(triangle, -2, axis=1) - np.roll(triangle, -1, axis=1)) / area[part, None, None]
            starts = _cross(np.roll(triangle, -1, axis=1), np.roll(triangle, -2, axis=1)) / area[part, None]
            shares = [starts[:, k, None] - edges[:, k, 1, None] * column + edges[:, k, 0, None] * row for k in range(3)]
            face, spot = np.nonzero(np.minimum(np.minimum(shares[0], shares[1]), shares[2]) >= 0)
            x, y = low[part[face], 0] + spot % side, low[part[face], 1] + spot // side
            seen = (x >= 0) & (y >= 0) & (x < width) & (y < height)
            face, spot = face[seen], spot[seen]
            share = np.stack([values[face, spot] for values in shares], axis=-1)
            found.append(((y * width + x)[seen], part[face], share))
        side, smallest = side + max(side // 2, 1), side
    if not found:
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 3), np.float32)
    pixel, face, share = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return pixel, face, share


def draw_mesh(
    canvas: Pixels, camera: Camera, vertices: Array, faces: NDArray[np.int64], color: Array, opacity: float = 1.0
) -> None:
    """Draw a closed mesh (counter-clockwise faces) onto the canvas, nearest surface on top."""
    points, depth = camera.project(vertices)
    corners = points[faces]
    # Pixels run downward, so that counter-clockwise seen from outside is a negative area here.
    front = faces[_cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) < 0]
    pixel, face, share = cover(points, front, (camera.width, camera.height))
    order = np.argsort(-(depth[front[face]] * share).sum(axis=1), kind="stable")
    pixel, used, share = pixel[order], front[face[order]], share[order]
    colors = shade(vertices, normals_of(vertices, faces), color, camera)
    flat = canvas.reshape(-1, 3)
    # Far to near: of several values for a pixel the last one stays.
    flat[pixel] += opacity * ((colors[used] * share[..., None]).sum(axis=1) - flat[pixel])


def draw_shadow(
    canvas: Pixels, camera: Camera, vertices: Array, faces: NDArray[np.int64], strength: float = 0.55
) -> None:
    """Darken the floor z = 0 where the mesh keeps the key light away."""
    light = camera.light
    fallen = vertices - np.maximum(vertices[:, 2:], 0) * (light / light[2])
    fallen[:, 2] = 0
    points, _ = camera.project(fallen)
    size = (camera.width // SHADOW_SCALE, camera.height // SHADOW_SCALE)
    pixel, _, _ = cover((points / SHADOW_SCALE).astype(np.float32), faces, size)
    mask = np.zeros(size[0] * size[1], np.uint8)
    mask[pixel] = 255
    image = Image.fromarray(mask.reshape(size[1], size[0])).filter(ImageFilter.GaussianBlur(camera.height / 400))
    shadow = np.asarray(image.resize((camera.width, camera.height), Image.Resampling.BILINEAR), np.float32)[..., None]
    canvas += shadow * (strength / 255) * (SHADOW - canvas)


def floor(camera: Camera, center: Array, radius: float, block: int = 1) -> Pixels:
    """An empty scene (height, width, 3): a grid of half metres on z = 0 that fades out around `center` (2,).

    Its lines are antialiased by themselves, so blocks of `block` x `block` pixels may share one value.
    """
    columns = ((np.arange(camera.width // block, dtype=np.float32) + 0.5) * block - camera.width / 2) / camera.focal
    rows = ((np.arange(camera.height // block, dtype=np.float32) + 0.5) * block - camera.height / 2) / camera.focal
    right, down, forward = camera.axes
    rays = forward + rows[:, None, None] * down + columns[None, :, None] * right
    drop = np.minimum(rays[..., 2:], -1e-4)
    reach = -camera.eye[2] / drop
    ground = camera.eye[:2] + reach * rays[..., :2]
    # A pixel covers this much of the floor, across the view and along it.
    footprint = block * reach / camera.focal / np.clip(-drop, 0.05, 1) * 0.75
    canvas = np.broadcast_to(GROUND, rays.shape).copy()
    for spacing, width, strength in ((0.5, 0.004, 0.5), (1.0, 0.007, 1.0)):
        distance = np.abs((ground / spacing + 0.5) % 1 - 0.5) * spacing
        line = np.clip((width - distance) / footprint + 0.5, 0, 1) * np.minimum(1, 2 * width / footprint)
        canvas += strength * line.max(axis=-1, keepdims=True) * (LINE - canvas)
    away = np.linalg.norm(ground - center, axis=-1, keepdims=True) / radius
    fade = np.clip(1.6 - away, 0, 1) * (rays[..., 2:] < -1e-4)
    canvas = SKY + fade * fade * (3 - 2 * fade) * (canvas - SKY)
    return canvas.repeat(block, axis=0).repeat(block, axis=1)


def to_image(canvas: Pixels) -> Image.Image:
    return Image.fromarray((np.clip(canvas, 0, 1) * 255 + 0.5).astype(np.uint8))


def _cross(first: Array, second: Array) -> Array:
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
