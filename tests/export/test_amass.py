"""AMASS files pose an SMPL model, by the equations of its paper, as the scene poses its body."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from motiongen.data.sources.folder import MotionFolder
from motiongen.export.scene import Scene
from motiongen.export.write import write
from motiongen.motion.bodies import smpl
from motiongen.motion.representation import unpack
from tests.export.motions import tumbling
from tests.motion.bodies.test_smpl import model, reference
from tests.motion.bodies.test_smpl import write as write_model


def written(path: Path, scene: Scene) -> dict[str, np.ndarray]:
    write(path, scene)
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


@pytest.mark.parametrize(("joints", "name"), [(24, "smpl"), (52, "smplh"), (55, "smplx")])
def test_the_model_lies_where_the_scenes_body_lies(tmp_path: Path, joints: int, name: str) -> None:
    arrays = model(joints)
    body = smpl(write_model(tmp_path / "model.npz", arrays), betas=[1.5, -2.0], gender="female")
    scene = tumbling(frames=3, body=body)
    found = written(tmp_path / "motion.npz", scene)
    assert (str(found["surface_model_type"]), str(found["gender"])) == (name, "female")
    assert found["betas"].tolist() == [1.5, -2.0, *[0.0] * 14]
    assert found["poses"].shape == (3, 3 * joints)
    betas = found["betas"][:10]
    rest_pelvis = (arrays["J_regressor"] @ (arrays["v_template"] + arrays["shapedirs"] @ betas))[0]
    np.testing.assert_allclose(found["rest_pelvis"], rest_pelvis, atol=1e-9)
    expected = body.vertices_of(scene.features).numpy()
    for frame in range(3):
        rotations = Rotation.from_rotvec(found["poses"][frame].reshape(-1, 3)).as_matrix()
        # The reference has its pelvis at the origin; SMPL has it at J0, and then adds trans.
        vertices = reference(arrays, rotations, betas) + rest_pelvis + found["trans"][frame]
        np.testing.assert_allclose(vertices, expected[frame], atol=2e-5)


def test_another_body_is_written_as_the_neutral_smplh(tmp_path: Path) -> None:
    scene = tumbling(fps=60.0)
    found = written(tmp_path / "motion.npz", scene)
    assert found["poses"].shape == (40, 156)
    assert not found["poses"][:, 66:].any()
    assert not found["betas"].any()
    assert found["betas"].shape == (16,)
    assert (str(found["surface_model_type"]), str(found["gender"])) == ("smplh", "neutral")
    assert found["mocap_framerate"] == found["mocap_frame_rate"] == 60.0
    rotations, pelvis = unpack(scene.features)
    turned = Rotation.from_rotvec(found["poses"][:, :66].reshape(-1, 3)).as_matrix().reshape(40, 22, 3, 3)
    np.testing.assert_allclose(turned, rotations.numpy(), atol=1e-6)
    np.testing.assert_allclose(found["trans"] + found["rest_pelvis"], pelvis.numpy(), atol=1e-6)


def test_a_folder_of_exported_files_holds_the_same_features(tmp_path: Path) -> None:
    scene = tumbling()
    write(tmp_path / "motion.npz", scene)
    (tmp_path / "labels.csv").write_text("file,tags\nmotion.npz,swing\n")
    (found,) = MotionFolder(root=str(tmp_path), skeleton=scene.body.skeleton).sequences()
    assert torch.allclose(found.features, scene.features, atol=1e-5)
