"""Bodies: rest pose, rigid motion, fitting to other skeletons, and where the shipped mesh comes from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import roma
import torch
from torch import Tensor

from motiongen.motion.bodies import Body, makehuman
from motiongen.motion.kinematics import forward_kinematics
from motiongen.motion.representation import pack
from motiongen.motion.skeleton import JOINT, JOINTS, Skeleton


@pytest.fixture(scope="module")
def body() -> Body:
    return makehuman()


def random_pose(seed: int, frames: int = 3) -> tuple[Tensor, Tensor]:
    generator = torch.Generator().manual_seed(seed)
    rotations = roma.rotvec_to_rotmat(0.5 * torch.randn(frames, JOINTS, 3, generator=generator))
    return rotations, torch.randn(frames, 3, generator=generator)


def identity(frames: int = 1) -> Tensor:
    return torch.eye(3).repeat(frames, JOINTS, 1, 1)


def test_zero_rotations_are_the_rest_pose(body: Body) -> None:
    shift = torch.tensor([[0.3, -0.2, 1.0]])
    torch.testing.assert_close(body.vertices(identity(), shift)[0], body.rest + shift, atol=1e-6, rtol=0)


def test_rest_pose_is_a_t_pose_in_smpl_axes(body: Body) -> None:
    joints = body.rest_joints
    for side, sign in (("left", 1), ("right", -1)):
        arm = joints[[JOINT[f"{side}_{name}"] for name in ("shoulder", "elbow", "wrist")]]
        leg = joints[[JOINT[f"{side}_{name}"] for name in ("hip", "knee", "ankle")]]
        assert (arm.diff(dim=0)[:, 0] * sign > 0.2).all()
        assert arm.diff(dim=0)[:, 1:].abs().max() < 1e-6
        assert (leg.diff(dim=0)[:, 1] < -0.3).all()
        assert leg.diff(dim=0)[:, [0, 2]].abs().max() < 1e-6
        toes = joints[JOINT[f"{side}_foot"]] - joints[JOINT[f"{side}_ankle"]]
        assert toes[2] > 3 * toes[0].abs()
    # The face, too, looks along +z: the nose sticks out of the head further than the back of it does.
    head = body.rest[body.weights.argmax(dim=1) == JOINT["head"]] - joints[JOINT["head"]]
    assert head[:, 2].max() > -head[:, 2].min()


def test_faces_point_outward_and_mesh_is_mirror_symmetric(body: Body) -> None:
    corners = body.rest[body.faces]
    volume = (torch.linalg.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]).sum() / 6
    assert 0.03 < float(volume) < 0.1  # cubic metres of a person
    mirrored = body.rest * torch.tensor([-1.0, 1.0, 1.0])
    nearest = torch.cdist(mirrored[::101], body.rest, compute_mode="donot_use_mm_for_euclid_dist").amin(dim=1)
    assert nearest.max() < 1e-4


def test_weights_are_convex(body: Body) -> None:
    assert (body.weights >= 0).all()
    torch.testing.assert_close(body.weights.sum(dim=1), torch.ones(len(body.rest)))


def test_rigid_motion_moves_every_vertex_rigidly(body: Body) -> None:
    rotations, translation = random_pose(0)
    turn = roma.random_rotmat()
    turned = rotations.clone()
    turned[:, 0] = turn @ rotations[:, 0]
    shift = torch.tensor([1.0, 2.0, 3.0])
    moved = body.vertices(turned, translation @ turn.T + shift)
    torch.testing.assert_close(moved, body.vertices(rotations, translation) @ turn.T + shift, atol=1e-5, rtol=0)


def test_a_vertex_of_one_joint_moves_with_that_joint(body: Body) -> None:
    rotations, translation = random_pose(1)
    world, joints = forward_kinematics(rotations, translation, body.skeleton)
    wrist = JOINT["left_wrist"]
    vertex = int((body.weights[:, wrist] == 1).nonzero()[0])
    expected = joints[:, wrist] + world[:, wrist] @ (body.rest[vertex] - body.rest_joints[wrist])
    torch.testing.assert_close(body.vertices(rotations, translation)[:, vertex], expected, atol=1e-6, rtol=0)


def test_joints_and_features_agree_with_kinematics(body: Body) -> None:
    rotations, translation = random_pose(2)
    joints = forward_kinematics(rotations, translation, body.skeleton)[1]
    assert torch.equal(body.joints(rotations, translation), joints)
    torch.testing.assert_close(
        body.vertices_of(pack(rotations, translation)), body.vertices(rotations, translation), atol=1e-5, rtol=0
    )


def test_fitting_to_its_own_skeleton_changes_nothing(body: Body) -> None:
    torch.testing.assert_close(body.fitted_to(body.skeleton).rest, body.rest, atol=1e-6, rtol=0)


def test_fitting_to_a_scaled_skeleton_scales_the_mesh(body: Body) -> None:
    fitted = body.fitted_to(Skeleton(1.3 * body.skeleton.offsets))
    torch.testing.assert_close(fitted.rest, 1.3 * body.rest, atol=1e-5, rtol=0)


def test_fitting_moves_flesh_with_longer_bones(body: Body) -> None:
    offsets = body.skeleton.offsets.clone()
    for side in ("left", "right"):
        offsets[JOINT[f"{side}_ankle"]] *= 1.2
    fitted = body.fitted_to(Skeleton(offsets))
    assert fitted.skeleton.offsets is not body.skeleton.offsets
    drop = float(body.rest[:, 1].min() - fitted.rest[:, 1].min())
    longer = 0.2 * float(body.skeleton.offsets[JOINT["left_ankle"]].norm())
    # The overall size grows by a few percent too, and with it the few centimetres below the ankle.
    assert drop == pytest.approx(longer, abs=0.01)


def test_fitting_survives_bones_without_length(body: Body) -> None:
    offsets = body.skeleton.offsets.clone()
    offsets[JOINT["spine2"]] = 0.0
    offsets[JOINT["left_elbow"]] = 0.0
    assert torch.isfinite(body.fitted_to(Skeleton(offsets)).rest).all()


def test_soles_of_a_fitted_body_stay_level(body: Body) -> None:
    offsets = body.skeleton.offsets.clone()
    for side in ("left", "right"):
        offsets[JOINT[f"{side}_foot"]] *= torch.tensor([1.0, 1.5, 0.8])
    fitted = body.fitted_to(Skeleton(offsets))
    sole = body.rest[:, 1] < body.rest[:, 1].min() + 0.004
    assert fitted.rest[sole, 1].std() < 1.6 * body.rest[sole, 1].std() + 1e-4


def test_mismatched_parts_are_named(body: Body) -> None:
    with pytest.raises(ValueError, match=r"body\.weights has shape \(3, 22\)"):
        replace(body, weights=body.weights[:3])


def test_skinning_back_to_the_a_pose_gives_the_artists_mesh(body: Body, shared_data: Path) -> None:
    path = shared_data / "body_cc0" / "body_22.npz"
    if not path.exists():
        pytest.skip(f"{path} is not here")
    source = np.load(path, allow_pickle=False)
    mesh, joints = (
        torch.from_numpy(source[name])[:, [0, 2, 1]] * torch.tensor([1.0, 1.0, -1.0]) for name in ("v", "j")
    )
    mesh, joints = mesh - joints[0], joints - joints[0]
    world = identity()[0]
    for side in ("left", "right"):
        for start, end in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist")):
            a, b = JOINT[f"{side}_{start}"], JOINT[f"{side}_{end}"]
            rest, bent = body.rest_joints[b] - body.rest_joints[a], joints[b] - joints[a]
            axis = torch.linalg.cross(rest / rest.norm(), bent / bent.norm())
            world[a] = roma.rotvec_to_rotmat(axis / axis.norm() * torch.asin(axis.norm()))
        world[JOINT[f"{side}_wrist"]] = world[JOINT[f"{side}_elbow"]]
    parents = torch.tensor([0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19])
    local = world[parents].transpose(-1, -2) @ world
    local[0] = world[0]
    posed = body.vertices(local, torch.zeros(3))
    distance = torch.cdist(posed[::13], mesh).amin(dim=1)
    # The shipped joints are made symmetric, by up to 3 mm.
    assert distance.max() < 0.008
    assert distance.mean() < 0.002
