"""Pictures of a data set: some of its clips, and which action follows which."""

from __future__ import annotations

from itertools import islice, zip_longest
from pathlib import Path

from PIL import Image

from motiongen.data.datamodule import MotionData
from motiongen.data.splits import Clip
from motiongen.data.statistics import Statistics
from motiongen.export.raster import strip
from motiongen.export.scene import Scene
from motiongen.files import replacing
from motiongen.motion.bodies.body import Body

CLIPS = 10
STRIP_HEIGHT = 150


def draw_clips(path: Path, data: MotionData, body: Body) -> Path:
    """Write a PNG with ten training clips as strips, of as many different tags as there are."""
    strips = [strip(_scene(data, clip, body), height=STRIP_HEIGHT) for clip in some_clips(data)]
    sheet = Image.new("RGB", (max(one.width for one in strips), sum(one.height for one in strips)), "white")
    top = 0
    for one in strips:
        sheet.paste(one, (0, top))
        top += one.height
    with replacing(path) as partial:
        sheet.save(partial, format="PNG", optimize=True)
    return path


def some_clips(data: MotionData) -> list[Clip]:
    """The first training clip of every tag, then the second of every tag, until there are ten."""
    by_tag: dict[str, list[Clip]] = {}
    for clip in data.split.train:
        by_tag.setdefault(_tags(data, clip)[0], []).append(clip)
    rounds = zip_longest(*(by_tag[tag] for tag in sorted(by_tag)))
    return list(islice((clip for clips in rounds for clip in clips if clip is not None), CLIPS))


def _scene(data: MotionData, clip: Clip, body: Body) -> Scene:
    tag = " + ".join(_tags(data, clip))
    features = data.store.features(clip.sequence, clip.start, clip.stop)
    return Scene(data.store.sequences[clip.sequence].name, features, body, labels=((0, len(features), tag),))


def _tags(data: MotionData, clip: Clip) -> tuple[str, ...]:
    return data.store.sequences[clip.sequence].segments[clip.segment].tags


def draw_transitions(path: Path, statistics: Statistics) -> Path:
    """Write a PNG of how often each tag (columns) follows each other one (rows)."""
    from matplotlib.figure import Figure

    tags, counts = statistics.tags, statistics.transitions
    size = 2.5 + 0.32 * len(tags)
    figure = Figure(figsize=(size + 1, size), layout="constrained")
    axes = figure.add_subplot()
    image = axes.imshow(counts, cmap="Blues")
    axes.set_xticks(range(len(tags)), tags, rotation=90, fontsize=8)
    axes.set_yticks(range(len(tags)), tags, fontsize=8)
    axes.set_xlabel("next action")
    axes.set_ylabel("action")
    for row, column in zip(*counts.nonzero(), strict=True):
        dark = counts[row, column] > counts.max() / 2
        axes.text(column, row, counts[row, column], ha="center", va="center", fontsize=6, color="w" if dark else "k")
    figure.colorbar(image, label="times")
    with replacing(path) as partial:
        figure.savefig(partial, dpi=110)
    return path
