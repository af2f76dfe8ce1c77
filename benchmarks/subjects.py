"""What is measured: generators with first weights, random poses, the built-in body with SMPL's number of vertices."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import roma
import torch
from hydra.utils import instantiate
from torch import Tensor

from benchmarks.measuring import Effort
from motiongen.configuration import compose
from motiongen.contracts import Condition, GeneratorModule, MotionBatch
from motiongen.data.clips import INITIAL_FRAMES
from motiongen.motion.bodies import Body, makehuman
from motiongen.motion.representation import FEATURES, TRANSLATION, pack
from motiongen.motion.skeleton import JOINTS
from motiongen.objectives.objective import Objective

TAGS = 20
SMPL_VERTICES = 6890


def composition(experiment: str, effort: Effort, features: int = FEATURES) -> tuple[GeneratorModule, Objective]:
    """A generator with weights from seed 0, for poses of so many numbers, and its objective, at the paper's scale."""
    # Of whatever size, the papers' order of layers and their weights, which the reference has.
    papers = ["scale.norm_first=false", "scale.kl_start=0.0", "scale.kl_end=0.0"]
    config = compose([f"+experiment={experiment}", f"scale={'smoke' if effort.quick else 'paper'}", *papers])
    torch.manual_seed(0)
    generator: GeneratorModule = instantiate(config.generator)(
        features=features, tags=TAGS, initial_frames=INITIAL_FRAMES, styles=0
    )
    return generator, instantiate(config.objective)


@cache
def body(vertices: int, correctives: bool = False) -> Body:
    """The built-in body, cut to a number of vertices; its corrections for the pose are random, of SMPL's size."""
    whole = makehuman()
    directions = None
    if correctives:
        draws = torch.Generator().manual_seed(0)
        directions = 1e-3 * torch.randn(vertices, 3, 9 * (JOINTS - 1), generator=draws)
    cut = replace(whole, rest=whole.rest[:vertices], weights=whole.weights[:vertices], faces=whole.faces[:0])
    return replace(cut, pose_directions=directions)


def poses(*shape: int, seed: int = 0) -> Tensor:
    """Random poses (*shape, 135), none of them unusual for a body."""
    draws = torch.Generator().manual_seed(seed)
    rotations = roma.rotvec_to_rotmat(0.3 * torch.randn(*shape, JOINTS, 3, generator=draws))
    return pack(rotations, torch.randn(*shape, 3, generator=draws))


def motion_batch(lengths: list[int], seed: int = 0) -> MotionBatch:
    """Random poses of these lengths, padded to the longest, each for one action out of `TAGS`."""
    batch, frames = len(lengths), max(lengths)
    mask = torch.arange(frames) < torch.tensor(lengths)[:, None]
    motion = poses(batch, frames, seed=seed) * mask.unsqueeze(-1)
    actions = torch.eye(TAGS)[torch.arange(batch) % TAGS]
    condition = Condition(
        tags=actions,
        next_tags=actions.roll(1, dims=0),
        initial_motion=poses(batch, INITIAL_FRAMES, seed=seed + 1),
        trajectory=motion[..., TRANSLATION][..., :2],
        mask=mask,
        styles=torch.zeros(batch, 0),
    )
    return MotionBatch(motion, condition)
