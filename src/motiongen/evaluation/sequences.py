"""Sequences of actions to judge long motion by (Neural Marionette, supplement 4.2)."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from motiongen.errors import InputError
from motiongen.motion.canonical import GroundFrame
from motiongen.motion.kinematics import joint_positions
from motiongen.options import NonNegativeFloat, PositiveInt, Share
from motiongen.suggestions import did_you_mean

if TYPE_CHECKING:
    from motiongen.data.datamodule import MotionData

KINDS = ("overall", "sufficient")
MOST_CONNECTED = 4
"""How many of the tags that most often follow are taken for `sufficient`."""


@dataclass(frozen=True, kw_only=True)
class SequenceProtocol:
    """Which sequences long motion is judged on. Results compare only when these are equal."""

    kinds: Sequence[str] = KINDS
    """`overall` and `sufficient`"""
    count: PositiveInt = 100
    """Sequences of each kind"""
    actions: PositiveInt = 20
    """Actions in each"""
    seed: int = 0
    """Of the sequences, and of what is generated"""
    confidence: Share = 0.5
    """Test clips are taken whose actions the recognizer is at least so sure of."""
    floor: bool = False
    """Whether every action is put on the floor, which the papers do not do."""
    smooth: bool = False
    """Whether all seams are smoothed; the paper smooths those where Shadow Start chose another begin of pose."""
    plausible_within: NonNegativeFloat = 0.05
    """Metres: for data without recorded transitions, how near one action's last pose has to be to another's first. One
    frame of walking is 2 cm, five are 9."""

    def __post_init__(self) -> None:
        """Raises InputError: a kind that does not exist."""
        for kind in self.kinds:
            if kind not in KINDS:
                known = ", ".join(KINDS)
                raise InputError(
                    f"sequences.kinds: there is no kind {kind!r}{did_you_mean(kind, KINDS)}; kinds: {known}"
                )


def recorded_transitions(data: MotionData) -> Tensor:
    """How often one action follows another at once in the training sequences: (A, A), from row to column."""
    counts = torch.zeros(len(data.tags), len(data.tags))
    trained = {clip.sequence for clip in data.split.train}
    for number in sorted(trained):
        segments = data.store.sequences[number].segments
        for one, other in itertools.pairwise(segments):
            counts += torch.outer(_columns(one.tags, data.tags), _columns(other.tags, data.tags))
    return counts


def plausible_transitions(data: MotionData, within: float) -> Tensor:
    """For data without recorded transitions: (A, A), 1 where an action could follow another.

    It could where some training clip of it begins with a pose that is within so many metres, in the mean over joints
    and with heading and place on the floor removed, of the last pose of some training clip of the other.
    """
    clips = data.split.train
    segments = [data.store.sequences[clip.sequence].segments[clip.segment] for clip in clips]
    tags = torch.stack([_columns(segment.tags, data.tags) for segment in segments])
    frames = [data.store.features(clip.sequence, clip.start - 1, clip.stop)[[0, -1]] for clip in clips]
    poses = torch.stack(frames)  # (M, 2, 135): before the first frame, and the last
    standing = GroundFrame.of(poses).enter(poses.unsqueeze(-2)).squeeze(-2)
    first, last = joint_positions(standing, data.skeleton).unbind(dim=1)
    distance = torch.stack([(first - own).norm(dim=-1).mean(dim=-1) for own in last])  # (M, M)
    return ((tags.T @ (distance < within).float() @ tags) > 0).float()


def draw_sequences(
    kind: str, transitions: Tensor, tags: Tensor, next_tags: Tensor, *, count: int, actions: int, seed: int
) -> list[list[int]]:
    """Chains of test clips, as numbers of clips.

    Every chain begins with another clip; once all have begun one, it is their turn again. The tag that follows is drawn
    uniformly: for `overall` from all that follow the current one in training at least once; for `sufficient` from the
    four that follow most often, the current tag, and the tag that follows the current clip in its recording. Then a
    clip of that tag is drawn. Where nothing follows, the tag stays.

    Args:
        kind: which set.
        transitions: (A, A) counts, from row to column.
        tags: (M, A) multi-hot, of the clips to choose from.
        next_tags: (M, A), what followed them; zero where that is unknown.
        count: chains.
        actions: clips in each.
        seed: of all draws.
    """
    rng = np.random.default_rng(seed)
    of_tag = [torch.nonzero(column).flatten().tolist() for column in tags.T]
    order: list[int] = []
    while len(order) < count:
        order += rng.permutation(len(tags)).tolist()
    chains = []
    for first in order[:count]:
        chain = [int(first)]
        while len(chain) < actions:
            options = _following(kind, transitions, tags[chain[-1]], next_tags[chain[-1]])
            options = [tag for tag in options if of_tag[tag]]
            tag = rng.choice(options) if options else int(tags[chain[-1]].argmax())
            chain.append(int(rng.choice(of_tag[tag])))
        chains.append(chain)
    return chains


def _following(kind: str, transitions: Tensor, tags: Tensor, next_tags: Tensor) -> list[int]:
    counts = tags @ transitions
    if kind == "overall":
        return torch.nonzero(counts).flatten().tolist()
    order = torch.argsort(counts, descending=True, stable=True)[:MOST_CONNECTED]
    chosen = torch.zeros_like(counts, dtype=torch.bool)
    chosen[order] = counts[order] > 0
    return torch.nonzero(chosen | (tags > 0) | (next_tags > 0)).flatten().tolist()


def _columns(labels: Sequence[str], columns: Sequence[str]) -> Tensor:
    return torch.tensor([float(column in labels) for column in columns])
