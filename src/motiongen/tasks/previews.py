"""What a person watches: generated motion beside the real clips that gave its condition, and one long motion."""

from __future__ import annotations

from pathlib import Path

import torch
from omegaconf import DictConfig

from motiongen.contracts import Condition, GeneratorModule, MotionBatch
from motiongen.data.datamodule import MotionData
from motiongen.data.dataset import collate
from motiongen.export.html import write_page
from motiongen.export.raster import render_gif, render_strip
from motiongen.export.scene import Scene
from motiongen.motion.bodies.body import Body
from motiongen.tasks.assembly import build_body


def write_previews(folder: Path, config: DictConfig, data: MotionData, generator: GeneratorModule) -> list[Path]:
    """One test clip of every tag, generated and real, as a page; the first that travels as an animation; strips of all.

    Returns the files, the page first. The seed is the first of the evaluation's.
    """
    body = build_body(config, data)
    batch, tags = one_clip_a_tag(data)
    device = next(generator.parameters()).device
    motion = generator.generate(batch.condition.to(device), config.evaluation.first_seed).cpu()
    generated = [scene(tag, "generated", batch.condition, motion, row, body) for row, tag in enumerate(tags)]
    real = [scene(tag, "real", batch.condition, batch.motion, row, body) for row, tag in enumerate(tags)]
    target = folder / "previews"
    target.mkdir(exist_ok=True)
    page = target / "motion.html"
    write_page(page, [shown for pair in zip(generated, real, strict=True) for shown in pair])
    travelling = [row for row, tag in enumerate(tags) if tag in data.store.root_tags]
    animation = target / "motion.gif"
    render_gif(animation, generated[travelling[0] if travelling else 0])
    strips = []
    for tag, shown in zip(tags, generated, strict=True):
        strips.append(target / f"{tag.replace(' ', '_').replace('/', '-')}.png")
        render_strip(strips[-1], shown)
    return [page, animation, *strips]


def one_clip_a_tag(data: MotionData) -> tuple[MotionBatch, list[str]]:
    """The first test clip of every tag, as one batch, and the tags in the same order."""
    chosen: dict[str, int] = {}
    items = data.test_items()
    for index in range(len(items)):
        column = int(items[index].tags.argmax())
        chosen.setdefault(data.tags[column], index)
    tags = sorted(chosen)
    return collate([items[chosen[tag]] for tag in tags]), tags


def scene(tag: str, kind: str, condition: Condition, motion: torch.Tensor, row: int, body: Body) -> Scene:
    """One motion of a batch with its initial motion in front and its trajectory on the floor."""
    length, initial = int(condition.lengths[row]), condition.initial_motion[row]
    path = condition.trajectory[row, :length]
    return Scene(
        title=f"{tag} ({kind})",
        features=torch.cat([initial, motion[row, :length]]),
        body=body,
        initial_frames=len(initial),
        trajectory=path if path.any() else None,
        labels=((len(initial), len(initial) + length, tag),),
    )
