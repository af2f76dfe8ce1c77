"""BVH files come back through two readers: the one of this repository and pybvh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pybvh
import pytest
import roma
import torch

from motiongen.data.sources.bvh import read_bvh
from motiongen.data.sources.folder import MotionFolder
from motiongen.export.scene import Scene
from motiongen.export.write import write
from motiongen.motion.bodies import makehuman
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import pack
from motiongen.motion.skeleton import JOINT, JOINT_NAMES, JOINTS, PARENTS
from tests.export.motions import swinging, tumbling


def z_up_metres(positions: np.ndarray) -> np.ndarray:
    """From centimetres with y up: the file's z is our -y."""
    return 0.01 * np.stack([positions[..., 0], -positions[..., 2], positions[..., 1]], axis=-1)


@pytest.fixture(params=[swinging, tumbling])
def scene(request: pytest.FixtureRequest) -> Scene:
    made: Scene = request.param()
    return made


def test_positions_come_back_through_pybvh(tmp_path: Path, scene: Scene) -> None:
    write(tmp_path / "motion.bvh", scene)
    found = pybvh.read_bvh_file(tmp_path / "motion.bvh", world_up="+y")
    positions = z_up_metres(np.asarray(found.joint_positions()))
    expected = joint_positions(scene.features, scene.body.skeleton).numpy()
    for joint, name in enumerate(JOINT_NAMES):
        assert np.abs(positions[:, found.joint_names.index(name)] - expected[:, joint]).max() < 1e-5, name


def test_positions_come_back_through_our_reader(tmp_path: Path, scene: Scene) -> None:
    write(tmp_path / "motion.bvh", scene)
    found = read_bvh(tmp_path / "motion.bvh")
    positions = z_up_metres(found.world()[1].numpy())[:, [found.names.index(name) for name in JOINT_NAMES]]
    assert np.abs(positions - joint_positions(scene.features, scene.body.skeleton).numpy()).max() < 1e-5
    assert found.fps == pytest.approx(30.0, abs=1e-5)


def test_a_folder_of_exported_files_holds_the_same_features(tmp_path: Path, scene: Scene) -> None:
    write(tmp_path / "motion.bvh", scene)
    (tmp_path / "labels.csv").write_text("file,tags\nmotion.bvh,swing\n")
    (found,) = MotionFolder(root=str(tmp_path), skeleton=scene.body.skeleton).sequences()
    assert torch.allclose(found.features, scene.features, atol=1e-5)


def test_the_rest_pose_is_the_t_pose_in_centimetres(tmp_path: Path) -> None:
    scene = tumbling()
    write(tmp_path / "motion.bvh", scene)
    found = read_bvh(tmp_path / "motion.bvh")
    assert sorted(found.names) == sorted(JOINT_NAMES)
    rest = dict.fromkeys(JOINT_NAMES, np.zeros(3))
    for name, parent, offset in zip(found.names, found.parents, found.offsets.numpy(), strict=True):
        above = -1 if parent < 0 else JOINT[found.names[parent]]
        assert above == PARENTS[JOINT[name]]
        rest[name] = offset if parent < 0 else rest[found.names[parent]] + offset
    np.testing.assert_allclose(
        np.array([rest[name] for name in JOINT_NAMES]), 100 * scene.body.rest_joints.numpy(), atol=1e-5
    )
    assert rest["head"][1] > 40  # y up
    assert rest["left_wrist"][0] > 40  # left is +x
    assert rest["left_foot"][2] > rest["left_ankle"][2] + 5  # forward is +z


def test_a_body_in_the_t_pose_has_zero_angles(tmp_path: Path) -> None:
    """A person who stands in our world and faces -y is the rest pose of the file, at (x, z, -y)."""
    vectors = torch.zeros(1, JOINTS, 3)
    vectors[:, 0, 0] = torch.pi / 2
    still = Scene("still", pack(roma.rotvec_to_rotmat(vectors), torch.tensor([[0.1, 0.2, 0.9]])), makehuman())
    write(tmp_path / "still.bvh", still)
    values = [float(word) for word in (tmp_path / "still.bvh").read_text().splitlines()[-1].split()]
    assert values == pytest.approx([10.0, 90.0, -20.0, *[0.0] * 3 * JOINTS], abs=1e-4)


def test_angles_change_as_slowly_as_the_limb(tmp_path: Path) -> None:
    """A turn of 400 degrees about x, past the pole of ZXY at 90 degrees, without jumps."""
    vectors = torch.zeros(81, JOINTS, 3)
    vectors[:, JOINT["left_knee"], 0] = torch.deg2rad(5.0 * torch.arange(81))
    vectors[:, JOINT["left_knee"], 0] += 0.01
    knee = Scene("knee", pack(roma.rotvec_to_rotmat(vectors), torch.zeros(81, 3)), makehuman())
    write(tmp_path / "knee.bvh", knee)
    rows = np.array([line.split() for line in (tmp_path / "knee.bvh").read_text().splitlines()[-81:]], dtype=float)
    assert np.abs(np.diff(rows, axis=0)).max() == pytest.approx(5.0, abs=1e-3)


def test_the_frame_rate_is_the_scenes(tmp_path: Path) -> None:
    write(tmp_path / "fast.bvh", replace(tumbling(), fps=120.0))
    assert read_bvh(tmp_path / "fast.bvh").fps == pytest.approx(120.0, abs=1e-3)
