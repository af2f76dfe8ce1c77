"""What a body does not do: sink into the floor, jerk, change its bones. One number a clip, over valid frames only."""

from __future__ import annotations

from torch import Tensor
from torch.nn.functional import pad

from motiongen.evaluation.metrics.motion import valid_mean
from motiongen.motion.skeleton import FEET, JOINTS, PARENTS


def floor_penetration(joints: Tensor, mask: Tensor, resting: Tensor) -> Tensor:
    """Depth of the ankles and toes below where they rest, mean over these joints and valid frames.

    joints (B, T, 22, 3) in metres, mask (B, T), resting (F,) from `resting_heights` of real motion, to (B,) float64:
    the mean of max(resting - height, 0); NaN for clips without a valid frame. Unit: centimetres. Range 0 to infinity,
    lower is better; real clips are above 0, as their resting height is a low percentile and not the least, so compare
    with theirs. Source: the penetration of Yuan et al. 2023 (PhysDiff), there of the lowest vertex below the ground,
    here of joints.
    """
    depth = (resting - joints[:, :, list(FEET), 2]).clamp(min=0)
    return valid_mean(depth.mean(dim=-1), mask) * 100


def peak_jerk(joints: Tensor, mask: Tensor, fps: float = 30.0) -> Tensor:
    """The largest jerk of any joint at any time.

    joints (B, T, J, 3) in metres, mask (B, T), to (B,) float64: max over frames and joints of |third difference| fps^3;
    NaN for clips of fewer than four frames. Unit: metres per second cubed. Range 0 to infinity; best near that of real
    clips: far above it the motion jumps, at a seam between actions for example. Source: Barquero et al. 2024 (FlowMDM),
    PJ, whose code takes the sum of absolute coordinates instead of the norm, metres per frame cubed, and the mean over
    clips before the maximum over frames.
    """
    curve, valid = _jerk(joints, mask, fps)
    # The column of zeros keeps clips without a valid frame from having no maximum; no jerk is below it.
    peak = pad(curve.masked_fill(~valid, 0.0), (0, 1)).amax(dim=1)
    return peak.masked_fill(~valid.any(dim=1), float("nan"))


def mean_jerk(joints: Tensor, mask: Tensor, fps: float = 30.0) -> Tensor:
    """The largest jerk of any joint, mean over time. Its mean over real clips is the reference of `jerk_area`.

    joints (B, T, J, 3) in metres, mask (B, T), to (B,) float64; NaN for clips of fewer than four frames. Unit: metres
    per second cubed. Range 0 to infinity; best near that of real clips. Source: as `peak_jerk`.
    """
    return valid_mean(*_jerk(joints, mask, fps))


def jerk_area(joints: Tensor, mask: Tensor, reference: float, fps: float = 30.0) -> Tensor:
    """How far the largest jerk of any joint is from that of real motion, mean over time.

    joints (B, T, J, 3) in metres, mask (B, T), reference in metres per second cubed, to (B,) float64: mean over frames
    of |max over joints of jerk - reference|; NaN for clips of fewer than four frames. Unit: metres per second cubed.
    Range 0 to infinity, lower is better; real clips are above 0, as their jerk varies, so compare with theirs. It sees
    what `peak_jerk` does not: soft jerks that last, and motion too smooth. Source: Barquero et al. 2024 (FlowMDM), AUJ,
    there a sum over the frames of transitions of one length, here a mean, so that clips of different lengths compare.
    """
    curve, valid = _jerk(joints, mask, fps)
    return valid_mean((curve - reference).abs(), valid)


def bone_length_drift(joints: Tensor, mask: Tensor) -> Tensor:
    """How much the most elastic bone changes its length.

    joints (B, T, 22, 3) in metres, mask (B, T), to (B,) float64: max over bones of the standard deviation (with N) over
    valid frames of the distance between a joint and its parent; NaN for clips without a valid frame. Unit: centimetres.
    Range 0 to infinity, lower is better: a rigid body has 0, so it tells only of motion that was made as positions and
    not as rotations. No paper's: defined here.

    Raises:
        ValueError: another number of joints.
    """
    if joints.shape[2] != JOINTS:
        raise ValueError(f"bones are known of {JOINTS} joints, not {joints.shape[2]}")
    lengths = (joints[:, :, 1:] - joints[:, :, list(PARENTS[1:])]).double().norm(dim=-1)
    clips, _, bones = lengths.shape
    series, valid = lengths.transpose(1, 2).flatten(0, 1), mask.repeat_interleave(bones, dim=0)
    variance = valid_mean((series - valid_mean(series, valid).unsqueeze(1)).square(), valid)
    return variance.sqrt().unflatten(0, (clips, bones)).amax(dim=1) * 100


def _jerk(joints: Tensor, mask: Tensor, fps: float) -> tuple[Tensor, Tensor]:
    """Largest jerk of any joint at every time (B, T - 3) float64, and where its four frames are valid (B, T - 3)."""
    curve = joints.double().diff(n=3, dim=1).norm(dim=-1).amax(dim=-1) * fps**3
    return curve, mask[:, 3:] & mask[:, 2:-1] & mask[:, 1:-2] & mask[:, :-3]
