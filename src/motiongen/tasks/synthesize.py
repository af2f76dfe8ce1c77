"""`task=synthesize run=... timeline=...`: long motion from a timeline of actions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from hydra.utils import instantiate
from omegaconf import DictConfig

from motiongen.data.datamodule import MotionData
from motiongen.export.formats import ENDINGS
from motiongen.export.html import write_page
from motiongen.export.raster import render_gif
from motiongen.export.scene import Scene
from motiongen.export.write import write
from motiongen.files import replacing
from motiongen.recognition.cache import obtain_recognizer
from motiongen.recognition.recognizer import Recognizer
from motiongen.synthesis.correction import Correction
from motiongen.synthesis.floor import Floor
from motiongen.synthesis.pipeline import LongMotion, Plan, synthesize
from motiongen.synthesis.planning import Planner
from motiongen.synthesis.ranking import recognized
from motiongen.synthesis.timeline import FPS, Timeline, read_timeline, resolve
from motiongen.tasks.assembly import build_body, build_data, run_folder, trained_generator
from motiongen.tasks.record import Record


@dataclass(frozen=True)
class Variant:
    """One motion made from a timeline."""

    plan: Plan
    motion: LongMotion
    score: float | None
    """How sure the recognizer is of its actions, where it was asked"""


def run(config: DictConfig) -> None:
    """Generate the timeline; the motions lie in the run folder as numbers (motion.npz), page and animation, and in the
    formats of `config.formats`. The first variant is motion.*, the second motion-2.*, and so on.
    """
    folder = run_folder()
    with Record(config, folder) as record:
        data = build_data(config)
        record.data(data)
        timeline = resolve(read_timeline(config.timeline), data.tags)
        variants = perform(config, timeline, data)
        scenes = scenes_of(config, timeline, variants, data)
        exports = []
        for number, (variant, scene) in enumerate(zip(variants, scenes, strict=True), start=1):
            name = "motion" if number == 1 else f"motion-{number}"
            write_motion(folder / f"{name}.npz", variant.motion, timeline, data)
            for chosen in config.formats:
                exports.append(folder / f"{name}{ENDINGS[chosen]}")
                write(exports[-1], scene)
        page, animation = folder / "motion.html", folder / "motion.gif"
        write_page(page, scenes)
        render_gif(animation, scenes[0])
        record.previews(page, animation)
        record.exports(exports)
    record.print_outcome()


def perform(config: DictConfig, timeline: Timeline, data: MotionData) -> list[Variant]:
    """The motions that the timeline asks for; the likeliest first with `config.rank`.

    The timeline's own seed and number of variants go before those of the configuration.

    Raises:
        TimelineError: the data does not have what the timeline asks for.
    """
    seed = config.seed if timeline.seed is None else timeline.seed
    count = config.variants if timeline.variants is None else timeline.variants
    planner = Planner(timeline, data)
    plans = [planner.plan(seed + number) for number in range(count)]
    correction: Correction = instantiate(config.correction)
    generator, _ = trained_generator(config, data)
    recognizer: Recognizer | None = None
    if config.rank or correction.asks_recognizer:
        recognizer = obtain_recognizer(config.recognizer, data, Path(config.cache)).recognizer
    longest = config.data.max_frames
    motions = synthesize(
        generator,
        plans,
        seed,
        correction=correction,
        recognizer=recognizer,
        longest=longest,
        smooth=config.smooth,
        floor=Floor.of(data) if config.floor else None,
    )
    if not config.rank or recognizer is None:
        return [Variant(plan, motion, None) for plan, motion in zip(plans, motions, strict=True)]
    variants = [
        Variant(plan, motion, recognized(motion, plan.steps, recognizer, longest))
        for plan, motion in zip(plans, motions, strict=True)
    ]
    return sorted(variants, key=lambda variant: variant.score or 0.0, reverse=True)


def scenes_of(config: DictConfig, timeline: Timeline, variants: list[Variant], data: MotionData) -> list[Scene]:
    """The motions to look at and to export."""
    body = build_body(config, data)
    scenes = []
    for number, variant in enumerate(variants, start=1):
        ends = variant.motion.boundaries
        spans = zip(ends, ends[1:], timeline.actions, strict=False)
        score = "" if variant.score is None else f" (log-probability {variant.score:.2f})"
        scenes.append(
            Scene(
                title=timeline.title if len(variants) == 1 else f"Variant {number}{score}: {timeline.title}",
                features=variant.motion.features,
                body=body,
                initial_frames=ends[0],
                trajectory=variant.motion.path,
                labels=tuple((start, stop, action.label) for start, stop, action in spans),
            )
        )
    return scenes


def write_motion(path: Path, motion: LongMotion, timeline: Timeline, data: MotionData) -> None:
    """Features in the world with everything needed to pose a body by them; whole or not at all."""
    with replacing(path) as partial:
        np.savez_compressed(
            partial,
            features=motion.features.numpy(),
            offsets=data.skeleton.offsets.numpy(),
            boundaries=np.array(motion.boundaries),
            tags=np.array([action.label for action in timeline.actions]),
            fps=FPS,
        )
