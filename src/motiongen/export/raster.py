"""Pictures of a scene without a GPU: an animated GIF, and a strip of poses along time as a PNG."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image, ImageColor, ImageDraw, ImageFont

from motiongen.export.rasterizer import (
    Array,
    Camera,
    Pixels,
    draw_mesh,
    draw_shadow,
    floor,
    to_image,
)
from motiongen.export.scene import Scene, outfit
from motiongen.files import replacing
from motiongen.motion.canonical import heading
from motiongen.motion.representation import TRANSLATION, unpack

SUPERSAMPLING = 2
GIVEN = "#a9b0bd"
"""Color of the initial pose."""
PATH = "#f97316"
INK = "#1f2937"
FAINT = "#6b7280"
VIEW = float(np.radians(24))
TURN = float(np.radians(38))
"""From the side, so that a walk reads, yet the face is seen: the figure looks to the right."""
FOLLOWED = 3.5
"""Motion that travels further than this many metres is followed by the camera."""


def render_gif(path: Path, scene: Scene, *, size: int = 480, max_frames: int = 150, palette: int = 200) -> None:
    """Write an animated GIF that loops: the body with its shadow, initial pose, asked-for path, labels and time.

    Long motion keeps its tempo and drops frames: at most 15 a second and `max_frames` in all.
    """
    step = max(1, round(scene.fps / 15), -(-scene.frames // max_frames))
    images = list(pictures(scene, range(0, scene.frames, step), size))
    shared = _palette(images, palette)
    images = [picture.quantize(palette=shared, dither=Image.Dither.NONE) for picture in images]
    with replacing(path) as partial:
        images[0].save(
            partial,
            format="GIF",
            save_all=True,
            append_images=images[1:],
            duration=_durations(len(images), 1000 * step / scene.fps),
            loop=0,
            optimize=False,
        )


def pictures(scene: Scene, picked: Sequence[int], size: int) -> Iterator[Image.Image]:
    """These frames of the scene, one after another: the body with its shadow, initial pose, path, labels and time."""
    vertices = _vertices(scene, picked)
    faces, colors = scene.body.faces.numpy(), outfit(scene.body).numpy()
    cameras = _cameras(scene, vertices, size * SUPERSAMPLING)
    given = None if scene.initial_frame is None else _vertices(scene, [scene.initial_frame])[0]
    for index, frame in enumerate(picked):
        camera = cameras[index]
        if index == 0 or camera is not cameras[index - 1]:
            empty = _stage(scene, camera)
            if given is not None:
                draw_mesh(empty, camera, given, faces, _rgb(GIVEN), opacity=0.35)
        canvas = empty.copy()
        draw_shadow(canvas, camera, vertices[index], faces)
        color = _rgb(GIVEN) if frame < scene.initial_frames else colors
        draw_mesh(canvas, camera, vertices[index], faces, color)
        picture = to_image(canvas).reduce(SUPERSAMPLING)
        _caption(picture, scene, frame)
        yield picture


def render_strip(path: Path, scene: Scene, *, frames: int = 8, height: int = 360) -> None:
    """Write the picture of `strip` as a PNG."""
    with replacing(path) as partial:
        strip(scene, frames=frames, height=height).save(partial, format="PNG", optimize=True)


def strip(scene: Scene, *, frames: int = 8, height: int = 360) -> Image.Image:
    """Poses side by side along time, evenly spaced, with the labels and seconds below.

    The first pose is the last initial frame (gray) where there is one. Poses stand beside each other whether or not the
    motion travels; heights and headings are the motion's.
    """
    start = scene.initial_frame or 0
    picked = np.unique(np.linspace(start, scene.frames - 1, frames).round().astype(int)).tolist()
    vertices = _vertices(scene, picked)
    azimuth = _azimuth(scene)
    right = np.array([np.cos(azimuth), -np.sin(azimuth), 0.0], np.float32)
    roots = scene.features[picked][:, TRANSLATION].numpy() * [1, 1, 0]
    vertices = vertices - roots[:, None].astype(np.float32)
    across = vertices @ right
    spacing = max(0.75, float((across.max(axis=1) - across.min(axis=1)).max()) + 0.08)
    places = (np.arange(len(picked)) - (len(picked) - 1) / 2) * spacing
    vertices += (places[:, None] * right)[:, None].astype(np.float32)
    view, top = float(np.radians(9)), max(float(vertices[..., 2].max()), 1.0)
    tall = top + 0.55
    width = int(height * (len(picked) * spacing + 0.5) / tall)
    camera = Camera.looking(
        np.array([0, 0, top / 2 - 0.03], np.float32),
        azimuth,
        float(np.radians(9)),
        tall / 2 / np.tan(view / 2),
        view,
        (width * SUPERSAMPLING, height * SUPERSAMPLING),
    )
    canvas = floor(camera, np.zeros(2, np.float32), max(len(picked) * spacing, 4.0), SUPERSAMPLING)
    faces, colors = scene.body.faces.numpy(), outfit(scene.body).numpy()
    for mesh in vertices:
        draw_shadow(canvas, camera, mesh, faces)
    for frame, mesh in zip(picked, vertices, strict=True):
        draw_mesh(canvas, camera, mesh, faces, _rgb(GIVEN) if frame < scene.initial_frames else colors)
    picture = to_image(canvas).reduce(SUPERSAMPLING)
    centers = camera.project((places[:, None] * right).astype(np.float32))[0][:, 0] / SUPERSAMPLING
    return _timeline(picture, scene, picked, centers.tolist())


def _vertices(scene: Scene, frames: Sequence[int]) -> Array:
    """(N, V, 3) of some frames."""
    with torch.no_grad():
        posed = scene.body.vertices(*unpack(scene.features[list(frames)].float()))
    return np.ascontiguousarray(posed.numpy(), dtype=np.float32)


def _azimuth(scene: Scene) -> float:
    """The camera's azimuth: beside the heading of the last initial frame."""
    return TURN - float(heading(scene.features[scene.initial_frame or 0]))


def _cameras(scene: Scene, vertices: Array, size: int) -> list[Camera]:
    """One camera per frame: still where the motion stays in place, else gliding along with it."""
    azimuth, elevation = _azimuth(scene), float(np.radians(11))
    low, high = vertices.min(axis=1), vertices.max(axis=1)
    middle = (low + high) / 2
    middle[:, 2] = max(float(high[:, 2].max()), 1.0) / 2
    travelled = float(np.linalg.norm(np.ptp(middle[:, :2], axis=0)))
    if travelled <= FOLLOWED:
        targets = np.repeat(((middle.min(axis=0) + middle.max(axis=0)) / 2)[None], len(middle), axis=0)
    else:
        window = min(15, len(middle))
        padded = np.pad(middle, ((window // 2, window - 1 - window // 2), (0, 0)), mode="edge")
        targets = np.stack([np.convolve(padded[:, k], np.full(window, 1 / window), "valid") for k in range(3)], axis=1)
    probe = Camera.looking(np.zeros(3, np.float32), azimuth, elevation, 1.0, VIEW, (size, size))
    seen = (vertices[:, ::29] - targets[:, None].astype(np.float32)) @ probe.axes.T
    # Far enough that the furthest vertex is inside 0.84 of the frame's half height.
    distance = float((np.abs(seen[..., :2]).max(axis=-1) / (0.84 * np.tan(VIEW / 2)) - seen[..., 2]).max())
    cameras = [Camera.looking(at, azimuth, elevation, distance, VIEW, (size, size)) for at in targets]
    return [cameras[0]] * len(cameras) if travelled <= FOLLOWED else cameras


def _stage(scene: Scene, camera: Camera) -> Pixels:
    """The floor with the path that was asked for."""
    ahead = camera.eye[2] / max(-float(camera.axes[2, 2]), 1e-3)
    center = (camera.eye + ahead * camera.axes[2])[:2]
    canvas = floor(camera, center, 5.0, SUPERSAMPLING)
    if scene.trajectory is not None and len(scene.trajectory) > 1:
        ground = torch.nn.functional.pad(scene.trajectory.float(), (0, 1)).numpy()
        spots = [(float(x), float(y)) for x, y in camera.project(ground)[0]]
        image = to_image(canvas)
        draw = ImageDraw.Draw(image)
        draw.line(spots, fill=PATH, width=camera.height // 120, joint="curve")
        radius = camera.height / 90
        x, y = spots[-1]
        draw.ellipse((x - radius, y - radius * 0.5, x + radius, y + radius * 0.5), fill=PATH)
        canvas = np.asarray(image, np.float32) / np.float32(255)
    return canvas


def _caption(picture: Image.Image, scene: Scene, frame: int) -> None:
    """Title, current labels, time, and a bar of the labels with a playhead."""
    draw = ImageDraw.Draw(picture)
    width, height = picture.size
    unit = height / 480
    margin, bar = round(16 * unit), round(6 * unit)
    draw.text((margin, margin * 0.8), scene.title, font=_font(17 * unit), fill=INK)
    text = "initial motion" if frame < scene.initial_frames else scene.label_at(frame)
    baseline = height - margin - bar - round(8 * unit)
    draw.text((margin, baseline), text, font=_font(19 * unit), fill=INK, anchor="ls")
    seconds = f"{frame / scene.fps:.1f} s"
    draw.text((width - margin, baseline), seconds, font=_font(15 * unit), fill=FAINT, anchor="rs")

    def column(at: float) -> float:
        return margin + (width - 2 * margin) * at / max(scene.frames - 1, 1)

    top = height - margin - bar
    draw.rectangle((margin, top, width - margin, top + bar), fill="#d6dbe4")
    for start, stop, label in scene.labels:
        draw.rectangle((column(start), top, column(min(stop, scene.frames - 1)), top + bar), fill=scene.color_of(label))
    if scene.initial_frames:
        draw.rectangle((margin, top, column(scene.initial_frames), top + bar), fill=GIVEN)
    at = column(frame)
    draw.rectangle((at - 1.5 * unit, top - 3 * unit, at + 1.5 * unit, top + bar + 3 * unit), fill=INK)


def _timeline(picture: Image.Image, scene: Scene, picked: list[int], centers: list[float]) -> Image.Image:
    """The picture with its title above and, below every pose, its time and a colored bar of its label."""
    foot, head = 58, 34
    sheet = Image.new("RGB", (picture.width, picture.height + foot + head), "white")
    sheet.paste(picture, (0, head))
    draw = ImageDraw.Draw(sheet)
    draw.text((14, head / 2), scene.title, font=_font(16), fill=INK, anchor="lm")
    top = picture.height + head
    half = (centers[1] - centers[0]) / 2 if len(centers) > 1 else picture.width / 2 - 10
    start = scene.initial_frame or 0
    texts = ["initial pose" if frame < scene.initial_frames else scene.label_at(frame) for frame in picked]
    for frame, center in zip(picked, centers, strict=True):
        seconds = f"{(frame - start) / scene.fps:.1f} s"
        draw.text((center, top + 14), seconds, font=_font(13), fill=FAINT, anchor="mm")
    first = 0
    for index in range(1, len(texts) + 1):
        if index < len(texts) and texts[index] == texts[first]:
            continue
        left, right = centers[first] - half + 3, centers[index - 1] + half - 3
        given = picked[first] < scene.initial_frames
        known = [label for *_, label in scene.labels if label in texts[first].split(" + ")]
        color = GIVEN if given or not known else scene.color_of(known[0])
        draw.rounded_rectangle((left, top + 27, right, top + 32), 2, fill=color)
        draw.text(((left + right) / 2, top + 45), texts[first], font=_font(14), fill=INK, anchor="mm")
        first = index
    return sheet


def _palette(pictures: list[Image.Image], size: int) -> Image.Image:
    """One palette for all pictures, so that only what moves changes.

    Every color counts once, however large its area: else the floor takes all and the body is left with bands.
    """
    chosen = [pictures[index] for index in np.linspace(0, len(pictures) - 1, min(6, len(pictures))).astype(int)]
    colors = np.concatenate([np.asarray(picture).reshape(-1, 3) for picture in chosen])
    distinct = np.unique(colors // 4, axis=0) * 4 + 2
    return Image.fromarray(distinct[None].astype(np.uint8)).quantize(size, Image.Quantize.MEDIANCUT)


def _durations(count: int, milliseconds: float) -> list[int]:
    """Durations in GIF's hundredths of a second that keep the tempo in the long run."""
    ends = np.round((np.arange(count + 1) * milliseconds) / 10).astype(int) * 10
    return [max(20, int(duration)) for duration in np.diff(ends)]


def _font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def _rgb(color: str) -> NDArray[np.float32]:
    return (np.array(ImageColor.getrgb(color)) / 255).astype(np.float32)
