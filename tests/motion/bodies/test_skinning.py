"""Linear blend skinning against a loop, its gradients, and pose blend shapes."""

from __future__ import annotations

import numpy as np
import pytest
import roma
import torch

from motiongen.motion.bodies.skinning import pose_offsets, skin


@pytest.fixture
def case() -> tuple[torch.Tensor, ...]:
    generator = torch.Generator().manual_seed(0)
    rest = torch.randn(11, 3, generator=generator, dtype=torch.float64)
    weights = torch.rand(11, 5, generator=generator, dtype=torch.float64)
    weights = weights / weights.sum(dim=1, keepdim=True)
    rotations = roma.rotvec_to_rotmat(torch.randn(2, 4, 5, 3, generator=generator, dtype=torch.float64))
    translations = torch.randn(2, 4, 5, 3, generator=generator, dtype=torch.float64)
    return rest, weights, rotations, translations


def test_agrees_with_a_loop_over_vertices(case: tuple[torch.Tensor, ...]) -> None:
    rest, weights, rotations, translations = (tensor.numpy() for tensor in case)
    expected = np.zeros((2, 4, 11, 3))
    for batch in np.ndindex(2, 4):
        for vertex in range(11):
            for joint in range(5):
                moved = rotations[batch][joint] @ rest[vertex] + translations[batch][joint]
                expected[batch][vertex] += weights[vertex, joint] * moved
    np.testing.assert_allclose(skin(*case).numpy(), expected, atol=1e-12)


def test_rest_vertices_may_differ_per_pose(case: tuple[torch.Tensor, ...]) -> None:
    rest, weights, rotations, translations = case
    varied = rest + torch.arange(8.0, dtype=torch.float64).reshape(2, 4, 1, 1)
    together = skin(varied, weights, rotations, translations)
    for batch in np.ndindex(2, 4):
        alone = skin(varied[batch], weights, rotations[batch], translations[batch])
        torch.testing.assert_close(together[batch], alone)


def test_gradients_are_right(case: tuple[torch.Tensor, ...]) -> None:
    rest, weights, rotations, translations = case
    inputs = (rest[:3], weights[:3], rotations[0, :2], translations[0, :2])
    assert torch.autograd.gradcheck(skin, tuple(tensor.clone().requires_grad_() for tensor in inputs))


def test_pose_offsets_agree_with_smpl_equation_9() -> None:
    generator = torch.Generator().manual_seed(1)
    directions = torch.randn(7, 3, 18, generator=generator, dtype=torch.float64)
    rotations = roma.rotvec_to_rotmat(torch.randn(4, 3, 3, generator=generator, dtype=torch.float64))
    expected = np.zeros((4, 7, 3))
    for frame in range(4):
        for joint in (1, 2):
            for row in range(3):
                for column in range(3):
                    entry = float(rotations[frame, joint, row, column]) - (row == column)
                    expected[frame] += entry * directions[:, :, 9 * (joint - 1) + 3 * row + column].numpy()
    np.testing.assert_allclose(pose_offsets(directions, rotations).numpy(), expected, atol=1e-12)
    assert pose_offsets(directions, torch.eye(3, dtype=torch.float64).repeat(3, 1, 1)).abs().max() == 0
