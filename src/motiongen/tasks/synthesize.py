"""`task=synthesize run=... timeline=...`: one long motion from a timeline of actions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from omegaconf import DictConfig

from motiongen.data.datamodule import MotionData
from motiongen.data.dataset import Item
from motiongen.export.formats import ENDINGS
from motiongen.export.html import write_page
from motiongen.export.raster import render_gif
from motiongen.export.scene import Scene
from motiongen.export.write import write
from motiongen.files import replacing
from motiongen.synthesis.paths import fit_path
from motiongen.synthesis.pipeline import LongMotion, Step, synthesize
from motiongen.synthesis.timeline import Action, parse_timeline
from motiongen.tasks.assembly import build_body, build_data, run_folder, trained_generator
from motiongen.tasks.record import Record

FPS = 30.0


def run(config: DictConfig) -> None:
    """Generate the timeline; the motion lies in the run folder as numbers (motion.npz), page and animation, and in the
    formats of `config.formats`.
    """
    folder = run_folder()
    with Record(config, folder) as record:
        data = build_data(config)
        record.data(data)
        actions = parse_timeline(config.timeline, data.tags)
        generator, _ = trained_generator(config, data)
        draw = torch.Generator().manual_seed(config.seed)
        steps = [plan(action, data, draw) for action in actions]
        start = initial_clip(actions[0], data, draw)
        motion = synthesize(
            generator, start.initial_motion, steps, config.seed, start.styles, longest=config.data.max_frames
        )
        write_motion(folder / "motion.npz", motion, actions, data)
        spans = zip(motion.boundaries, motion.boundaries[1:], actions, strict=False)
        scene = Scene(
            title=config.timeline,
            features=motion.features,
            body=build_body(config, data),
            initial_frames=motion.boundaries[0],
            labels=tuple((start, stop, " + ".join(action.tags)) for start, stop, action in spans),
        )
        page, animation = folder / "motion.html", folder / "motion.gif"
        write_page(page, [scene])
        render_gif(animation, scene)
        exports = [folder / f"motion{ENDINGS[name]}" for name in config.formats]
        for path in exports:
            write(path, scene)
        record.previews(page, animation)
        record.exports(exports)
    record.print_outcome()


def initial_clip(action: Action, data: MotionData, draw: torch.Generator) -> Item:
    """A training clip with the action's tags, drawn at random: its initial motion begins the long motion (supplement,
    section 5.2), and its style, where the data has styles, is that of the whole.
    """
    items = _training_clips(action, data)
    return data.train_items()[items[int(torch.randint(len(items), (), generator=draw))]]


def plan(action: Action, data: MotionData, draw: torch.Generator) -> Step:
    """The action with its tags as a vector and, where it travels, the path of a training clip."""
    frames = action.frames(FPS)
    tags = torch.tensor([float(tag in action.tags) for tag in data.tags])
    if not set(action.tags) & set(data.store.root_tags):
        return Step(tags, frames)
    items, clips = data.train_items(), _training_clips(action, data)
    enough = [clip for clip in clips if len(items.clips[clip]) >= frames]
    longest = max(clips, key=lambda clip: len(items.clips[clip]))
    chosen = enough[int(torch.randint(len(enough), (), generator=draw))] if enough else longest
    return Step(tags, frames, fit_path(items[chosen].trajectory, frames))


def write_motion(path: Path, motion: LongMotion, actions: tuple[Action, ...], data: MotionData) -> None:
    """Features in the world with everything needed to pose a body by them; whole or not at all."""
    with replacing(path) as partial:
        np.savez_compressed(
            partial,
            features=motion.features.numpy(),
            offsets=data.skeleton.offsets.numpy(),
            boundaries=np.array(motion.boundaries),
            tags=np.array([" + ".join(action.tags) for action in actions]),
            fps=FPS,
        )


def _training_clips(action: Action, data: MotionData) -> list[int]:
    """Numbers of the training items that bear the first of the action's tags."""
    sequences = data.store.sequences
    return [
        index
        for index, clip in enumerate(data.train_items().clips)
        if action.tags[0] in sequences[clip.sequence].segments[clip.segment].tags
    ]
