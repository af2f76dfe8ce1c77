"""How fast motions of many actions are made, and in how much memory: MARIONET at `scale=small` on random poses.

Half of the actions follow a path. A frame should cost the same however late in a motion it comes. Memory is that of the
process at its peak, above what it held with the generator built.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import torch
from hydra.utils import instantiate

from benchmarks.measuring import Effort, interleaved, peak_mebibytes
from benchmarks.results import Figure, Result
from benchmarks.subjects import TAGS
from motiongen.configuration import compose
from motiongen.data.clips import INITIAL_FRAMES
from motiongen.motion.representation import FEATURES, pack
from motiongen.motion.skeleton import JOINTS
from motiongen.synthesis.paths import RecordedPath
from motiongen.synthesis.pipeline import Plan, Step, synthesize

TITLE = "Long motion, actions of 60 frames"


def making(batch: int, actions: int, frames: int, scale: str) -> Callable[[], object]:
    """`batch` motions of `actions` actions of `frames` frames each."""
    torch.manual_seed(0)
    config = compose(["+experiment=marionette", f"scale={scale}"])
    generator = instantiate(config.generator)(features=FEATURES, tags=TAGS, initial_frames=INITIAL_FRAMES, styles=0)
    poses = pack(torch.eye(3).expand(INITIAL_FRAMES, JOINTS, 3, 3), torch.tensor([0.0, 0.0, 0.9]).expand(6, 3))
    path = RecordedPath(torch.stack([torch.zeros(frames), -0.03 * torch.arange(1, frames + 1)], dim=-1))
    steps = [Step(torch.eye(TAGS)[number % TAGS], frames, path if number % 2 else None) for number in range(actions)]
    return partial(synthesize, generator.eval(), [Plan(poses, steps)] * batch, seed=0)


def measure(effort: Effort) -> list[Result]:
    scale, frames, actions = "smoke" if effort.quick else "small", effort.size(60, 4), effort.size(20, 2)
    lengths = [1, 2] if effort.quick else [5, 20, 60]
    batches = [1, 2] if effort.quick else [1, 16, 64]
    by_length = {str(count): making(1, count, frames, scale) for count in lengths}
    taken = interleaved(by_length, effort)
    found: list[Result] = [
        Figure(f"a frame of one motion, {count} actions", 1000 * taken[str(count)].median / (count * frames), "ms")
        for count in lengths
    ]
    together = interleaved({str(batch): making(batch, actions, frames, scale) for batch in batches}, effort)
    for batch in batches:
        rate = batch * actions * frames / together[str(batch)].median
        memory = peak_mebibytes(effort, making, batch, actions, frames, scale)
        found.append(Figure(f"{batch} motions of {actions} actions", rate, "frames / s"))
        found.append(Figure(f"{batch} motions of {actions} actions, memory", memory, "MiB"))
    return found
