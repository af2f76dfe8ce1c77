"""What is measured on every clip: recognizer outputs and motion quantities, from which the metrics are computed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Self

import torch
from torch import Tensor

from motiongen.contracts import Condition, MotionBatch
from motiongen.evaluation.metrics.motion import (
    foot_skating,
    frozen_share,
    joint_position_error,
    joint_speed,
    resting_heights,
    trajectory_error,
)
from motiongen.evaluation.metrics.physics import floor_penetration, jerk_area, mean_jerk, peak_jerk
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import TRANSLATION
from motiongen.motion.skeleton import Skeleton
from motiongen.recognition.recognizer import Recognizer
from motiongen.recognition.signals import fill_padding

if TYPE_CHECKING:
    from motiongen.data.datamodule import MotionData


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
    """(N,) centimetres; NaN where no real motion answers the same condition."""
    joint_speed: Tensor
    """(N,) metres per second; NaN for clips of one frame."""
    frozen_share: Tensor
    """(N,) share of the time; NaN for clips of one frame."""
    foot_skating: Tensor
    """(N,) centimetres per frame; NaN where no foot touches the floor."""
    floor_penetration: Tensor
    """(N,) centimetres"""
    peak_jerk: Tensor
    """(N,) metres per second cubed; NaN for clips of fewer than four frames."""
    mean_jerk: Tensor
    """(N,) metres per second cubed; NaN for clips of fewer than four frames."""
    jerk_area: Tensor
    """(N,) metres per second cubed; NaN for clips of fewer than four frames."""

    def __len__(self) -> int:
        return len(self.tags)

    @classmethod
    def concatenate(cls, parts: Iterable[Self]) -> Self:
        """The judgements of all parts, in order."""
        parts = list(parts)
        return cls(**{field.name: torch.cat([getattr(part, field.name) for part in parts]) for field in fields(cls)})


@dataclass(frozen=True)
class Judge:
    """Measures every system in the same way."""

    recognizer: Recognizer
    """In eval mode."""
    skeleton: Skeleton
    """The body whose joints are measured."""
    travels: Tensor
    """(A,) bool: tags whose actions travel, so that their trajectory is specified."""
    resting: Tensor
    """(F,) metres: heights of the feet's joints when flat on the floor."""
    frozen_speed: float
    """Metres per second below which a body counts as frozen."""
    usual_jerk: float
    """Metres per second cubed: the mean of the real test clips."""

    @classmethod
    def of(cls, recognizer: Recognizer, data: MotionData, batches: Sequence[MotionBatch], frozen_speed: float) -> Self:
        """A judge for this data whose real test clips are `batches`, on the recognizer's device."""
        travels = torch.tensor([tag in data.store.root_tags for tag in data.tags])
        masks = [batch.condition.mask for batch in batches]
        filled = [fill_padding(batch.motion, batch.condition.mask) for batch in batches]
        joints = [joint_positions(motion, data.skeleton) for motion in filled]
        frames = torch.cat([own[mask] for own, mask in zip(joints, masks, strict=True)]).unsqueeze(0)
        resting = resting_heights(frames, torch.ones_like(frames[..., 0, 0], dtype=torch.bool))
        jerks = torch.cat([mean_jerk(own, mask) for own, mask in zip(joints, masks, strict=True)])
        return cls(recognizer, data.skeleton, travels, resting, frozen_speed, float(jerks.nanmean().nan_to_num(0.0)))

    @torch.inference_mode()
    def __call__(self, motion: Tensor, batch: MotionBatch) -> Judgement:
        """Measure motions (B, T, 135) made for the batch's condition against its real ones; one recognizer pass.

        Raises:
            ValueError: motion of another shape than the real one, or with a valid frame that is not finite.
        """
        mask, shape = batch.condition.mask, tuple(batch.motion.shape)
        if motion.shape != shape:
            raise ValueError(f"generated motion has shape {tuple(motion.shape)}, the condition asks for {shape}")
        if not motion[mask].isfinite().all():
            raise ValueError("generated motion has frames that are not finite")
        motion, real = fill_padding(motion, mask), fill_padding(batch.motion, mask)
        seen = self.recognizer(motion, mask)
        joints, real_joints = joint_positions(motion, self.skeleton), joint_positions(real, self.skeleton)
        path_error = trajectory_error(motion[..., TRANSLATION][..., :2], batch.condition.trajectory, mask)
        specified = ((batch.condition.tags > 0) & self.travels.to(mask.device)).any(dim=1)
        judged = Judgement(
            tags=batch.condition.tags,
            logits=seen.logits,
            features=seen.features,
            trajectory_error=path_error.masked_fill(~specified, float("nan")),
            joint_position_error=joint_position_error(joints, real_joints, mask),
            joint_speed=joint_speed(joints, mask),
            frozen_share=frozen_share(joints, mask, self.frozen_speed),
            foot_skating=foot_skating(joints, mask, self.resting),
            floor_penetration=floor_penetration(joints, mask, self.resting),
            peak_jerk=peak_jerk(joints, mask),
            mean_jerk=mean_jerk(joints, mask),
            jerk_area=jerk_area(joints, mask, self.usual_jerk),
        )
        return Judgement(**{field.name: getattr(judged, field.name).double().cpu() for field in fields(judged)})

    def alone(self, motion: Tensor, condition: Condition) -> Judgement:
        """As a call, of motions (B, T, 135) that no real motion is the counterpart of."""
        judged = self(motion, MotionBatch(motion.new_zeros(*condition.mask.shape, motion.shape[-1]), condition))
        return replace(judged, joint_position_error=torch.full_like(judged.joint_position_error, torch.nan))
