"""Transitions that were not recorded, made while training: a clip that begins from the poses of another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import roma
import torch
from torch import Tensor

from motiongen.data.clips import INITIAL_FRAMES
from motiongen.data.splits import Clip
from motiongen.motion.canonical import GroundFrame
from motiongen.motion.representation import TRANSLATION, pack, unpack
from motiongen.motion.transition import smooth_seam

FADE = (8, 25)
"""Least and most frames within which a clip is its own again."""
DRIFT_ANGLE, DRIFT_HEIGHT = 0.25, 0.1
"""Standard deviations of the largest drift: radians of a joint's rotation, metres of the pelvis' height."""


@dataclass(frozen=True)
class Transition:
    """What a clip is made to begin from."""

    sequence: int
    stop: int
    """The frames [stop - 6, stop) of that sequence come before the clip"""
    fade: int
    """Frames within which the difference to the clip's own beginning fades"""
    drift: int
    """Seed of what the poses before are off by"""


def draw_transition(clips: Sequence[Clip], rng: np.random.Generator) -> Transition:
    """Poses from any of the clips, as likely the last ones of a clip as others."""
    clip = clips[int(rng.integers(len(clips)))]
    stop = clip.stop if rng.random() < 0.5 else int(rng.integers(clip.start + 1, clip.stop, endpoint=True))
    return Transition(clip.sequence, stop, int(rng.integers(*FADE, endpoint=True)), int(rng.integers(2**31)))


def begin_from(features: Tensor, before: Tensor, transition: Transition) -> Tensor:
    """A clip (K + T, 135) in the canonical frame that begins from world frames before (K, 135), off by some drift.

    The difference between the last of them and the clip's own beginning fades as where long motion is joined
    (`smooth_seam`), so that what is learned is to come back from poses in which no recorded action of this kind begins,
    or which generated motion has drifted to.
    """
    drifted = _drifted(before, transition.drift)
    initial = GroundFrame.of(drifted[-1]).enter(drifted)
    motion = features[INITIAL_FRAMES:].unsqueeze(0)
    joined = smooth_seam(initial.unsqueeze(0), motion, torch.tensor([transition.fade]))
    return torch.cat([initial, joined.squeeze(0)])


def _drifted(motion: Tensor, seed: int) -> Tensor:
    """Frames (K, 135) with every joint turned by one small rotation and the body raised or sunk a little."""
    draw = torch.Generator().manual_seed(seed)
    size = torch.rand((), generator=draw)
    rotations, position = unpack(motion)
    turn = roma.rotvec_to_rotmat(size * DRIFT_ANGLE * torch.randn(rotations.shape[1], 3, generator=draw))
    drifted = pack(rotations @ turn, position)
    drifted[:, TRANSLATION.stop - 1] += size * DRIFT_HEIGHT * torch.randn((), generator=draw)
    return drifted
