"""What is measured on every clip: recognizer outputs and motion quantities, from which the metrics are computed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Self

import torch
from torch import Tensor

from motiongen.contracts import Condition
from motiongen.evaluation.metrics.motion import foot_skating, joint_position_error, joint_speed, trajectory_error
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import TRANSLATION
from motiongen.motion.skeleton import Skeleton
from motiongen.recognition.recognizer import Recognizer
from motiongen.recognition.signals import fill_padding


@dataclass(frozen=True)
class Judgement:
    """Measurements of N clips, on the CPU in float64."""

    tags: Tensor
    """(N, A) multi-hot: the action that was asked for."""
    logits: Tensor
    """(N, A)"""
    features: Tensor
    """(N, E)"""
    trajectory_error: Tensor
    """(N,) metres; NaN where no trajectory was specified."""
    joint_position_error: Tensor
    """(N,) centimetres"""
    joint_speed: Tensor
    """(N,) metres per second; NaN for clips of one frame."""
    foot_skating: Tensor
    """(N,) centimetres per frame; NaN where no foot touches the floor."""

    def __len__(self) -> int:
        return len(self.tags)

    @classmethod
    def concatenate(cls, parts: Iterable[Self]) -> Self:
        """The judgements of all parts, in order."""
        parts = list(parts)
        return cls(**{field.name: torch.cat([getattr(part, field.name) for part in parts]) for field in fields(cls)})

    def choose(self, rows: Tensor) -> Judgement:
        """The judgements at these indices."""
        return Judgement(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})


def root_columns(tags: Sequence[str], root_tags: Iterable[str]) -> Tensor:
    """(A,) bool: which tags let an action travel, so that its trajectory is specified."""
    travelling = frozenset(root_tags)
    return torch.tensor([tag in travelling for tag in tags])


@torch.inference_mode()
def judge(
    motion: Tensor, reference: Tensor, condition: Condition, recognizer: Recognizer, skeleton: Skeleton, root: Tensor
) -> Judgement:
    """Measure a batch of motions (B, T, 135) against the real ones (B, T, 135); one recognizer pass.

    Args:
        motion: what is judged, in the condition's canonical frame.
        reference: the real motion under the same condition.
        condition: what was asked for; its mask says which frames count.
        recognizer: in eval mode, on the device of `motion`.
        skeleton: the body whose joints are measured.
        root: (A,) bool from `root_columns`.

    Raises:
        ValueError: motion of another shape than the reference, or with a non-finite valid frame.
    """
    mask = condition.mask
    if motion.shape != reference.shape:
        raise ValueError(
            f"generated motion has shape {tuple(motion.shape)}, the condition asks for {tuple(reference.shape)}"
        )
    if not motion[mask].isfinite().all():
        raise ValueError("generated motion has frames that are not finite")
    motion, reference = fill_padding(motion, mask), fill_padding(reference, mask)
    seen = recognizer(motion, mask)
    joints, real_joints = joint_positions(motion, skeleton), joint_positions(reference, skeleton)
    path_error = trajectory_error(motion[..., TRANSLATION][..., :2], condition.trajectory, mask)
    specified = (condition.tags.cpu() > 0) & root
    judged = Judgement(
        tags=condition.tags,
        logits=seen.logits,
        features=seen.features,
        trajectory_error=path_error.cpu().masked_fill(~specified.any(dim=1), float("nan")),
        joint_position_error=joint_position_error(joints, real_joints, mask),
        joint_speed=joint_speed(joints, mask),
        foot_skating=foot_skating(joints, mask),
    )
    return Judgement(**{field.name: getattr(judged, field.name).double().cpu() for field in fields(judged)})
