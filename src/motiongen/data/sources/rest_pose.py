"""How the joint frames of any rig stand in SMPL's T-pose.

A joint's local rotation means the same as SMPL's only if it is counted from the same pose. `align` (22, 3, 3) holds
each joint's frame in SMPL's T-pose, columns in SMPL's axes; `retarget.smpl_pose` takes it off. Where the body stands
upright when all rotations are zero, that pose tells everything: limbs are turned straight, the rest keeps its frame.
Other rigs lay one axis of every frame along its bone; these are told from how the body holds itself on average.
"""

from __future__ import annotations

from itertools import permutations, product

import roma
import torch
from torch import Tensor

from motiongen.data.sources.retarget import rotation_between
from motiongen.motion.skeleton import JOINT, JOINTS, PARENTS

LEFT, UP, FORWARD = torch.eye(3, dtype=torch.float64)
STRAIGHT = {
    JOINT[f"{side}_{name}"]: direction
    for side, out in (("left", LEFT), ("right", -LEFT))
    for name, direction in (("hip", -UP), ("knee", -UP), ("shoulder", out), ("elbow", out))
}
"""Where the bones of the limbs point in the T-pose."""
CHILD = {
    **{parent: joint for joint, parent in enumerate(PARENTS) if joint},
    **{JOINT[parent]: JOINT[child] for parent, child in (("pelvis", "spine1"), ("spine3", "neck"))},
}
"""The joint that a bone leads to; of several, the one along the spine."""
FEET = tuple((JOINT[f"{side}_ankle"], JOINT[f"{side}_foot"]) for side in ("left", "right"))
SQUARE = torch.stack(
    [
        torch.diag(torch.tensor(signs, dtype=torch.float64))[list(order)]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
)
SQUARE = SQUARE[torch.linalg.det(SQUARE) > 0]
"""(24, 3, 3) the turns of a cube"""


def bones(rotations: Tensor, positions: Tensor, ends: list[tuple[int, int]]) -> Tensor:
    """(N, 3) the mean position of each second joint in the frame of the first.

    Args:
        rotations: (T, 22, 3, 3) world rotations.
        positions: (T, 22, 3) world positions.
        ends: pairs of joints.
    """
    starts, stops = [start for start, _ in ends], [stop for _, stop in ends]
    across = positions[:, stops] - positions[:, starts]
    return (rotations[:, starts].transpose(-1, -2) @ across.unsqueeze(-1)).squeeze(-1).mean(dim=0)


def is_upright(pose: Tensor) -> bool:
    """Whether joints (22, 3), y up, stand on straight legs with the head on top."""
    y = pose[:, 1]
    legs = [y[JOINT[f"{side}_hip"]] - y[JOINT[f"{side}_ankle"]] for side in ("left", "right")]
    lengths = [_length(pose, "hip", "knee", side) + _length(pose, "knee", "ankle", side) for side in ("left", "right")]
    trunk = y[JOINT["head"]] - y[JOINT["pelvis"]]
    return bool(
        trunk > 0.7 * (pose[JOINT["head"]] - pose[JOINT["pelvis"]]).norm()
        and all(leg > 0.7 * length > 0 for leg, length in zip(legs, lengths, strict=True))
    )


def align_from_zero_pose(frames: Tensor, pose: Tensor) -> Tensor:
    """(22, 3, 3) from joint frames (22, 3, 3) and joints (22, 3), y up, of an upright body whose rotations are zero."""
    across = pose[JOINT["left_hip"]] - pose[JOINT["right_hip"]] + pose[JOINT["left_shoulder"]]
    across = across - pose[JOINT["right_shoulder"]]
    # Rigs face along an axis: what differs from a quarter turn is how unlike their two sides are.
    quarter = torch.pi / 2 * torch.round(torch.atan2(across[2], across[0]) / (torch.pi / 2))
    facing = roma.rotvec_to_rotmat(quarter * UP)
    return _straightened(facing @ frames, bones(frames[None], pose[None], list(CHILD.items())))


def align_from_motion(rotations: Tensor, positions: Tensor) -> Tensor:
    """(22, 3, 3) from motion: world rotations (T, 22, 3, 3) and joints (T, 22, 3), y up, feet on the floor at times.

    Relative to the pelvis, the average pose of a body that stands and walks is near to standing. It says which axis
    points where, to less than 45 degrees; axes then point exactly along the bones and square to them. Feet are level
    where the ankle is lowest, and toes keep their mean bend.
    """
    directions = bones(rotations, positions, list(CHILD.items()))
    place = {joint: number for number, joint in enumerate(CHILD)}
    hips = bones(rotations, positions, [(0, JOINT["left_hip"]), (0, JOINT["right_hip"])])
    left = torch.nn.functional.normalize(hips[0] - hips[1], dim=0)
    forward = torch.nn.functional.normalize(torch.linalg.cross(left, directions[place[0]]), dim=0)
    pelvis = _squared(torch.stack([left, torch.linalg.cross(forward, left), forward]))
    body = rotations[:, :1] @ pelvis.T
    mean = roma.special_procrustes((body.transpose(-1, -2) @ rotations).mean(dim=0))
    flat = _flat_foot(positions)
    align = _straightened(mean, directions, {ankle: flat for ankle, _ in FEET})
    in_foot = torch.stack([LEFT, flat, torch.linalg.cross(LEFT, flat)], dim=1)
    for joint in range(JOINTS):
        align[joint] = _squared(align[joint])
    for ankle, foot in FEET:
        turned = _straightened(mean, directions, {ankle: flat})[ankle]
        align[ankle] = in_foot @ _squared(in_foot.T @ turned)
        bend = (rotations[:, ankle].transpose(-1, -2) @ rotations[:, foot]).mean(dim=0)
        align[foot] = align[ankle] @ roma.special_procrustes(bend)
    return align


def _straightened(frames: Tensor, directions: Tensor, more: dict[int, Tensor] | None = None) -> Tensor:
    """Joint frames (22, 3, 3) of a body that faces +z, turned so that limbs, and the bones in `more`, are straight.

    A limb's joint is turned along with the one before it, and hands with the arm: an elbow that is bent forward, below
    an arm that hangs, is not the same as one that is bent forward while the arm is held out.
    """
    place = {joint: number for number, joint in enumerate(CHILD)}
    turn = torch.eye(3, dtype=torch.float64).repeat(JOINTS, 1, 1)
    for joint, end in {**STRAIGHT, **(more or {})}.items():
        before = turn[PARENTS[joint]] @ frames[joint] @ directions[place[joint]]
        turn[joint] = rotation_between(before, end) @ turn[PARENTS[joint]]
    for side in ("left", "right"):
        turn[JOINT[f"{side}_wrist"]] = turn[JOINT[f"{side}_elbow"]]
    return turn @ frames


def _squared(frame: Tensor) -> Tensor:
    """The turn of a cube that is nearest to a rotation (3, 3)."""
    return SQUARE[(SQUARE * frame).sum(dim=(1, 2)).argmax()]


def _flat_foot(positions: Tensor) -> Tensor:
    """(3,) where the ankles' bones point in the tenth of the frames in which each is lowest, seen from the side."""
    slopes = []
    for ankle, foot in FEET:
        heights = positions[:, ankle, 1]
        lowest = heights <= heights.quantile(0.1)
        bone = (positions[:, foot] - positions[:, ankle])[lowest]
        slopes.append((bone[:, 1] / bone.norm(dim=-1)).median().clamp(-1, 1).asin())
    slope = torch.stack(slopes).mean()
    return slope.sin() * UP + slope.cos() * FORWARD


def _length(pose: Tensor, one: str, other: str, side: str) -> Tensor:
    return (pose[JOINT[f"{side}_{one}"]] - pose[JOINT[f"{side}_{other}"]]).norm()
