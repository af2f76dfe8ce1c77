"""Measures long motions action by action: what each is recognized as, and how it begins (Neural Marionette, 5.2.2)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.utils.rnn import pad_sequence

from motiongen.evaluation.judgement import Judge
from motiongen.evaluation.metrics.motion import foot_skating, frozen_share
from motiongen.evaluation.metrics.physics import peak_jerk
from motiongen.evaluation.metrics.seams import pose_gap, velocity_gap
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.skeleton import FEET
from motiongen.synthesis.pipeline import LongMotion, canonical_parts

SEAM_FRAMES = 6
"""Frames on either side of a seam within which its jerk is looked for."""
BATCH = 256


@dataclass(frozen=True)
class Act:
    """One action of a long motion."""

    sequence: int
    """Number of the long motion"""
    index: int
    """Its place in it, counted from 0"""
    tags: Tensor
    """(A,) multi-hot: what it was to be"""
    before: Tensor
    """(K, 135) the frames just before it, in the same frame of reference as the motion"""
    motion: Tensor
    """(T, 135)"""


@dataclass(frozen=True)
class LongJudgement:
    """Measurements of P actions, on the CPU in float64; M motions of N actions, in order."""

    sequence: Tensor
    """(P,)"""
    index: Tensor
    """(P,)"""
    tags: Tensor
    """(P, A)"""
    logits: Tensor
    """(P, A): mean over the parts of an action that is longer than the recognizer's windows"""
    values: dict[str, Tensor]
    """Figure to (P,), NaN where an action has none"""
    features: Tensor
    """(Q, E), of the parts"""
    part_index: Tensor
    """(Q,): `index` of the action that each part is of"""


def acts_of(motions: Iterable[LongMotion], tags: Iterable[Sequence[Tensor]], initial_frames: int) -> Iterator[Act]:
    """The actions of long motions; `tags`: of every motion, those of its actions, (A,)."""
    for sequence, (motion, own) in enumerate(zip(motions, tags, strict=True)):
        for index, (action, start, stop) in enumerate(zip(own, motion.boundaries, motion.boundaries[1:], strict=False)):
            before = motion.features[start - initial_frames : start]
            yield Act(sequence, index, action, before, motion.features[start:stop])


@torch.inference_mode()
def judge_acts(acts: Sequence[Act], judge: Judge, longest: int) -> LongJudgement:
    """Measure actions; `longest`: frames of the windows that the recognizer knows, longer actions are cut for it.

    - `pose_gap`, `velocity_gap`: at the seam where the action begins.
    - `seam_jerk`: the largest of any joint within SEAM_FRAMES of it, metres per second cubed.
    - `foot_skating`: centimetres per frame, over the action.
    - `floor_gap`: how far the lowest of the feet's joints is from its resting height, at its lowest in the action, in
      centimetres: bodies that sink or float. Defined here.
    - `frozen_share`: of the action's time.
    """
    logits, features, part_index = _recognized(acts, judge, longest)
    return LongJudgement(
        sequence=torch.tensor([act.sequence for act in acts]),
        index=torch.tensor([act.index for act in acts]),
        tags=torch.stack([act.tags for act in acts]),
        logits=logits,
        values=_values(acts, judge),
        features=features,
        part_index=part_index,
    )


def _recognized(acts: Sequence[Act], judge: Judge, longest: int) -> tuple[Tensor, Tensor, Tensor]:
    """Logits (P, A) of the actions, features (Q, E) of their parts, and the parts' action index (Q,)."""
    owners, parts = zip(
        *(
            (owner, part)
            for owner, act in enumerate(acts)
            for part in canonical_parts(act.before[-1], act.motion, longest)
        ),
        strict=True,
    )
    logits, features = [], []
    for first in range(0, len(parts), BATCH):
        motion, mask = _padded(parts[first : first + BATCH])
        seen = judge.recognizer(motion, mask)
        logits.append(seen.logits.double().cpu())
        features.append(seen.features.double().cpu())
    owner = torch.tensor(owners)
    every = torch.cat(logits)
    total = torch.zeros(len(acts), every.shape[1], dtype=every.dtype).index_add(0, owner, every)
    index = torch.tensor([acts[number].index for number in owners])
    return total / torch.bincount(owner).unsqueeze(-1), torch.cat(features), index


def _values(acts: Sequence[Act], judge: Judge) -> dict[str, Tensor]:
    found: dict[str, list[Tensor]] = {}
    for first in range(0, len(acts), BATCH):
        some = acts[first : first + BATCH]
        motion, mask = _padded([act.motion for act in some])
        joints = joint_positions(motion, judge.skeleton)
        before = joint_positions(torch.stack([act.before for act in some]), judge.skeleton)
        seam = torch.cat([before[:, -SEAM_FRAMES:], joints[:, :SEAM_FRAMES]], dim=1)
        near = torch.cat([torch.ones_like(before[:, -SEAM_FRAMES:, 0, 0]), mask[:, :SEAM_FRAMES]], dim=1) > 0
        above = (joints[:, :, list(FEET), 2] - judge.resting).amin(dim=-1)
        values = {
            "pose_gap": pose_gap(before, joints),
            "velocity_gap": velocity_gap(before, joints).masked_fill(mask.sum(dim=1) < 2, torch.nan),
            "seam_jerk": peak_jerk(seam, near),
            "foot_skating": foot_skating(joints, mask, judge.resting),
            "floor_gap": above.masked_fill(~mask, torch.inf).amin(dim=1).abs() * 100,
            "frozen_share": frozen_share(joints, mask, judge.frozen_speed),
        }
        for name, own in values.items():
            found.setdefault(name, []).append(own.double().cpu())
    return {name: torch.cat(own) for name, own in found.items()}


def _padded(motions: Sequence[Tensor]) -> tuple[Tensor, Tensor]:
    """(B, T, 135), the last frame held where a motion is over, so that padding has joints; and the mask (B, T)."""
    lengths = torch.tensor([len(motion) for motion in motions])
    frames = torch.arange(int(lengths.max()))
    held = torch.minimum(frames, lengths.unsqueeze(-1) - 1)
    stacked = pad_sequence(list(motions), batch_first=True)
    return stacked.gather(1, held.unsqueeze(-1).expand_as(stacked)), frames < lengths.unsqueeze(-1)
