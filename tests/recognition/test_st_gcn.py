from __future__ import annotations

import pytest
import torch

from motiongen.errors import InputError
from motiongen.motion.representation import FEATURES
from motiongen.motion.skeleton import JOINT, JOINTS, PARENTS, Skeleton
from motiongen.recognition.st_gcn import Block, GraphConvolution, STGCNRecognizer, spatial_partition


def edges_to_the_pelvis(joint: int) -> int:
    return 0 if joint == 0 else 1 + edges_to_the_pelvis(PARENTS[joint])


def test_neighbours_are_parted_by_their_distance_to_the_pelvis() -> None:
    found = spatial_partition()
    for one in range(JOINTS):
        near = [other for other in range(JOINTS) if other == one or PARENTS[other] == one or PARENTS[one] == other]
        for other in range(JOINTS):
            distances = edges_to_the_pelvis(other) - edges_to_the_pelvis(one)
            part = {0: 0, -1: 1, 1: 2}[distances] if other in near else None
            expected = [1 / len(near) if part == k else 0.0 for k in range(3)]
            assert found[:, one, other].tolist() == pytest.approx(expected)


def test_a_knee_takes_from_itself_its_hip_and_its_ankle() -> None:
    hip, knee, ankle = (JOINT[f"left_{name}"] for name in ("hip", "knee", "ankle"))
    taken = {tuple(place.tolist()) for place in spatial_partition()[:, knee].nonzero()}
    assert taken == {(0, knee), (1, hip), (2, ankle)}


def test_a_graph_convolution_is_a_sum_over_parts_and_neighbours() -> None:
    torch.manual_seed(0)
    adjacency = spatial_partition()
    layer = GraphConvolution(4, 5, adjacency)
    with torch.no_grad():
        layer.importance.uniform_(0.5, 1.5)
        joints = torch.randn(2, 3, JOINTS, 4)
        found = layer(joints)
        weights = layer.projection.weight.unflatten(1, (3, 4))  # (outputs, parts, inputs)
        expected = torch.zeros(2, 3, JOINTS, 5)
        for k, i, j in adjacency.nonzero().tolist():
            edge = adjacency[k, i, j] * layer.importance[k, i, j]
            expected[:, :, i] += edge * (joints[:, :, j] @ weights[:, k].T)
    torch.testing.assert_close(found, expected)


@pytest.mark.parametrize(("inputs", "stride"), [(8, 1), (8, 2), (6, 1), (6, 2)])
def test_a_block_keeps_padding_zero_and_apart(inputs: int, stride: int) -> None:
    torch.manual_seed(0)
    block = Block(inputs, 8, kernel=9, stride=stride, dropout=0.0).eval()
    joints, lengths = torch.randn(3, 12, JOINTS, inputs), (12, 7, 1)
    mask = torch.arange(12) < torch.tensor(lengths).unsqueeze(1)
    with torch.no_grad():
        found = block(joints * mask[..., None, None], mask)
        for clip, length in enumerate(lengths):
            alone = block(joints[clip : clip + 1, :length], mask[clip : clip + 1, :length])[0]
            assert len(alone) == -(-length // stride)
            torch.testing.assert_close(found[clip, : len(alone)], alone)
            assert (found[clip, len(alone) :] == 0).all()


def test_the_frame_rate_is_halved_where_channels_grow() -> None:
    network = STGCNRecognizer(
        tags=3, skeleton=Skeleton(torch.zeros(JOINTS, 3)), channels=[8, 8, 16, 16], feature_width=24
    )
    assert [block.stride for block in network.blocks] == [1, 1, 2, 1, 2]
    assert [block.around is None for block in network.blocks] == [False, True, False, True, False]


@pytest.mark.parametrize("padding", [0.0, 1e6, float("nan")])
def test_padding_does_not_shift_what_is_gathered_while_training(padding: float) -> None:
    def gathered(frames: int) -> dict[str, torch.Tensor]:
        torch.manual_seed(0)
        network = STGCNRecognizer(
            tags=3, skeleton=Skeleton(torch.randn(JOINTS, 3) * 0.2), channels=[8], feature_width=16, dropout=0.0
        ).train()
        mask = torch.arange(frames) < torch.tensor([[12], [7], [1]])
        motion = torch.full((3, frames, FEATURES), padding)
        valid = torch.randn(3, 12, FEATURES)
        motion[mask] = valid[mask[:, :12]]
        network(motion, mask)
        return dict(network.named_buffers())

    tight, loose = gathered(12), gathered(25)
    assert sum(name.endswith("running_var") for name in tight) == 7
    for name, buffer in tight.items():
        torch.testing.assert_close(loose[name], buffer)


def test_a_kernel_has_a_middle() -> None:
    with pytest.raises(InputError, match="kernel: 8 frames"):
        STGCNRecognizer(tags=3, skeleton=Skeleton(torch.zeros(JOINTS, 3)), kernel=8)
