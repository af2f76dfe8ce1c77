"""A skinned body on the 22-joint skeleton."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import torch
from torch import Tensor

from motiongen.motion.bodies.skinning import pose_offsets, skin
from motiongen.motion.kinematics import forward_kinematics
from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import JOINT, JOINTS, PARENTS, Skeleton

TORSO = [JOINT[name] for name in ("spine1", "spine2", "spine3", "left_collar", "right_collar", "neck")]
LIMBS = {
    JOINT[f"{side}_{start}"]: JOINT[f"{side}_{end}"]
    for side in ("left", "right")
    for start, end in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
}
"""Joint -> the joint at the end of its bone, for the bones whose flesh follows them."""
COLLARS = {JOINT[f"{side}_collar"]: JOINT[f"{side}_shoulder"] for side in ("left", "right")}
TOES = {JOINT[f"{side}_ankle"]: JOINT[f"{side}_foot"] for side in ("left", "right")}
SHORTEST = 1e-3
"""Bones below this length in metres have no direction to follow."""


@dataclass(frozen=True)
class SmplModel:
    """What names a body in files of the SMPL family, which hold no bones."""

    name: Literal["smpl", "smplh", "smplx"]
    gender: Literal["neutral", "female", "male"]
    betas: tuple[float, ...]
    """Shape coefficients."""
    rest_pelvis: tuple[float, float, float]
    """The pelvis joint J0 of the rest pose in the model's own frame, metres; with these betas."""


@dataclass(frozen=True)
class Body:
    """A mesh that follows the pose by linear blend skinning.

    Zero rotations are SMPL's T-pose in SMPL's axes (x to the left, y up, z forward), and the translation is the world
    position of the pelvis joint.
    """

    skeleton: Skeleton
    faces: Tensor
    """(F, 3) int64, counter-clockwise seen from outside."""
    rest: Tensor
    """(V, 3) vertices of the rest pose relative to the pelvis joint, metres."""
    weights: Tensor
    """(V, 22) skinning weights, rows add up to 1."""
    pose_directions: Tensor | None = None
    """(V, 3, 189) pose blend shapes as in SMPL, or none."""
    model: SmplModel | None = None
    """The model that the body was made from, whatever skeleton it was fitted to later; none outside the SMPL family."""

    def __post_init__(self) -> None:
        vertices = len(self.rest)
        expected: dict[str, tuple[int, ...]] = {
            "rest": (vertices, 3),
            "weights": (vertices, JOINTS),
            "faces": (len(self.faces), 3),
        }
        if self.pose_directions is not None:
            expected["pose_directions"] = (vertices, 3, 9 * (JOINTS - 1))
        for name, shape in expected.items():
            if (found := tuple(getattr(self, name).shape)) != shape:
                raise ValueError(f"body.{name} has shape {found}, not {shape}")

    @property
    def rest_joints(self) -> Tensor:
        """(22, 3) joints of the rest pose relative to the pelvis, metres."""
        return skeleton_joints(self.skeleton)

    def vertices(self, rotations: Tensor, translation: Tensor) -> Tensor:
        """Pose the mesh: local rotations (..., 22, 3, 3) and pelvis positions (..., 3) to (..., V, 3), metres."""
        rest = self.rest
        if self.pose_directions is not None:
            rest = rest + pose_offsets(self.pose_directions, rotations)
        return skin(rest, self.weights, *self.transforms(rotations, translation))

    def transforms(self, rotations: Tensor, translation: Tensor) -> tuple[Tensor, Tensor]:
        """World rotations (..., 22, 3, 3) of the joints, and where each takes the rest pose's origin, (..., 22, 3)."""
        world, joints = forward_kinematics(rotations, translation, self.skeleton)
        return world, joints - (world @ self.rest_joints.to(joints).unsqueeze(-1)).squeeze(-1)

    def joints(self, rotations: Tensor, translation: Tensor) -> Tensor:
        """World positions of the joints, (..., 22, 3), metres."""
        return forward_kinematics(rotations, translation, self.skeleton)[1]

    def vertices_of(self, features: Tensor) -> Tensor:
        """Features (..., 135) to vertices (..., V, 3), metres."""
        return self.vertices(*unpack(features))

    def fitted_to(self, skeleton: Skeleton) -> Body:
        """Give the body another skeleton's bones, so that motion recorded on it meets floor and hands where it did.

        Flesh turns and stretches along with its bone, keeps its girth but for the overall size, and is blended by the
        skinning weights. The torso is stretched as one from pelvis to neck, since data sets place spine joints and
        collars freely. Soles stay level, as far below the toe joints as the skeleton's ankles say.
        """
        skeleton = Skeleton(skeleton.offsets.to(self.rest))
        old, new = self.rest_joints, skeleton_joints(skeleton)
        size = float(skeleton.offsets.norm(dim=-1).sum() / self.skeleton.offsets.norm(dim=-1).sum())
        linear = size * torch.eye(3).to(self.rest).repeat(JOINTS, 1, 1)
        fixed, anchors = old.clone(), new.clone()
        for joint, end in LIMBS.items():
            linear[joint] = _stretch(old[end] - old[joint], new[end] - new[joint], size)
        linear[TORSO] = _stretch(old[JOINT["neck"]], new[JOINT["neck"]], size)
        for parts, joint in ((TORSO, JOINT["left_shoulder"]), ([JOINT["pelvis"]], JOINT["left_hip"])):
            # Chest and hips: halfway (geometrically) between the joints' distance and the overall size.
            linear[parts, :, 0] *= (new[joint, 0] / old[joint, 0] / size).clamp(0.5, 2).sqrt()
        fixed[TORSO] = anchors[TORSO] = 0.0
        for collar, shoulder in COLLARS.items():
            # Halfway between the chest and the shoulder that they join.
            fixed[collar], anchors[collar] = old[shoulder], (linear[collar] @ old[shoulder] + new[shoulder]) / 2
        for ankle, toes in TOES.items():
            was, becomes = old[toes] - old[ankle], new[toes] - new[ankle]
            # Down and forward apart, without a turn: what was level stays level.
            across = torch.tensor([size, *(becomes[1:] / was[1:]).clamp(0.5 * size, 2 * size).tolist()])
            linear[[ankle, toes]] = torch.diag(across).to(linear)
            anchors[toes, 1] = new[ankle, 1] + across[1] * was[1]
        shift = anchors - (linear @ fixed.unsqueeze(-1)).squeeze(-1)
        directions = None if self.pose_directions is None else self.pose_directions * size
        rest = skin(self.rest, self.weights, linear, shift)
        return replace(self, skeleton=skeleton, rest=rest, pose_directions=directions)

    def to(self, device: torch.device | str) -> Body:
        moved: dict[str, Any] = {
            field.name: value.to(device)
            for field in fields(self)
            if isinstance(value := getattr(self, field.name), Tensor)
        }
        return replace(self, skeleton=Skeleton(self.skeleton.offsets.to(device)), **moved)


def skeleton_joints(skeleton: Skeleton) -> Tensor:
    """Joints of the rest pose relative to the pelvis (22, 3), metres."""
    joints = [torch.zeros_like(skeleton.offsets[0])]
    for joint, parent in enumerate(PARENTS[1:], start=1):
        joints.append(joints[parent] + skeleton.offsets[joint])
    return torch.stack(joints)


def _stretch(old: Tensor, new: Tensor, girth: float) -> Tensor:
    """The map (3, 3) that takes one bone to another and scales what is across it by `girth`."""
    identity = torch.eye(3).to(old)
    if old.norm() < SHORTEST or new.norm() < SHORTEST:
        return girth * identity
    start, end = old / old.norm(), new / new.norm()
    # Rodrigues' formula for the smallest rotation from start to end: the wedge product is its skew matrix.
    skew = torch.outer(end, start) - torch.outer(start, end)
    turn = identity + skew + skew @ skew / (1 + start @ end)
    along = torch.outer(start, start)
    return turn @ (girth * (identity - along) + new.norm() / old.norm() * along)
