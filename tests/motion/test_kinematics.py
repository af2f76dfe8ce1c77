from __future__ import annotations

import numpy as np
import pytest
import roma
import torch

from motiongen.motion.kinematics import forward_kinematics, global_rotations, joint_positions
from motiongen.motion.representation import pack, unpack
from motiongen.motion.skeleton import PARENTS
from tests.compositions import skeleton
from tests.motion.poses import standing


def chain(rotations: np.ndarray, translation: np.ndarray, offsets: np.ndarray, joint: int) -> np.ndarray:
    """World transform of a joint as a product of 4x4 matrices from the root: an implementation of its own."""
    local = np.eye(4)
    local[:3, :3] = rotations[joint]
    local[:3, 3] = translation if joint == 0 else offsets[joint]
    return local if joint == 0 else chain(rotations, translation, offsets, PARENTS[joint]) @ local


def test_against_homogeneous_matrices():
    torch.manual_seed(0)
    rotations, translation = roma.random_rotmat((3, 22), dtype=torch.float64), torch.randn(3, 3, dtype=torch.float64)
    world, positions = forward_kinematics(rotations, translation, skeleton())
    offsets = skeleton().offsets.double().numpy()
    for pose in range(3):
        for joint in range(22):
            expected = chain(rotations[pose].numpy(), translation[pose].numpy(), offsets, joint)
            np.testing.assert_allclose(positions[pose, joint].numpy(), expected[:3, 3], atol=1e-12)
            np.testing.assert_allclose(world[pose, joint].numpy(), expected[:3, :3], atol=1e-12)


def test_pack_and_unpack_are_inverse():
    torch.manual_seed(0)
    rotations, translation = roma.random_rotmat((4, 5, 22), dtype=torch.float64), torch.randn(4, 5, 3).double()
    again, position = unpack(pack(rotations, translation))
    torch.testing.assert_close(again, rotations)
    assert torch.equal(position, translation)


def test_standing_up_turns_y_to_z():
    """The rest pose has y up and z forward; standing, a bone along y points up and one along z points to -y."""
    positions = joint_positions(standing(1), skeleton())[0]
    offset = skeleton().offsets[1]
    torch.testing.assert_close(positions[1] - positions[0], torch.stack([offset[0], -offset[2], offset[1]]))


def test_gradients_flow_to_every_rotation():
    features = standing(2).requires_grad_()
    joint_positions(features, skeleton()).square().sum().backward()
    leaves = {15, 20, 21, 10, 11}
    for joint in range(22):
        moved = features.grad[:, 6 * joint : 6 * joint + 6].abs().sum() > 0
        assert moved == (joint not in leaves), joint


def test_gradient_against_products_of_matrices():
    torch.manual_seed(0)
    rotations = roma.random_rotmat((4, 22), dtype=torch.float64).requires_grad_()
    weights = torch.randn(4, 22, 3, 3, dtype=torch.float64)
    world = [rotations[:, 0]]
    for joint, parent in enumerate(PARENTS[1:], start=1):
        world.append(world[parent] @ rotations[:, joint])
    (expected,) = torch.autograd.grad((torch.stack(world, dim=1) * weights).sum(), rotations)
    (found,) = torch.autograd.grad((global_rotations(rotations) * weights).sum(), rotations)
    torch.testing.assert_close(found, expected, atol=1e-12, rtol=0)


@pytest.mark.parametrize("poses", [(), (0,), (2, 3)])
def test_poses_of_any_shape(poses):
    torch.manual_seed(0)
    one = roma.random_rotmat(22)
    world, positions = forward_kinematics(one.expand(*poses, 22, 3, 3), torch.ones(*poses, 3), skeleton())
    world_of_one, positions_of_one = forward_kinematics(one, torch.ones(3), skeleton())
    assert torch.equal(world, world_of_one.expand(*poses, 22, 3, 3))
    assert torch.equal(positions, positions_of_one.expand(*poses, 22, 3))
