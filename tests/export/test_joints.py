from __future__ import annotations

from pathlib import Path

import numpy as np

from motiongen.export.write import write
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.skeleton import JOINT_NAMES
from tests.export.motions import tumbling


def test_numpy_reads_the_positions_back_by_name(tmp_path: Path) -> None:
    scene = tumbling(fps=24.0)
    write(tmp_path / "motion.csv", scene)
    table = np.genfromtxt(tmp_path / "motion.csv", delimiter=",", names=True)
    expected = joint_positions(scene.features, scene.body.skeleton).numpy()
    np.testing.assert_array_equal(table["frame"], np.arange(40))
    np.testing.assert_allclose(table["time"], np.arange(40) / 24, atol=1e-6)
    for joint, name in enumerate(JOINT_NAMES):
        found = np.stack([table[f"{name}_{axis}"] for axis in "xyz"], axis=1)
        np.testing.assert_allclose(found, expected[:, joint], atol=5e-6)
    assert len(table.dtype.names) == 2 + 3 * len(JOINT_NAMES)


def test_a_single_frame_has_a_header_and_a_row(tmp_path: Path) -> None:
    write(tmp_path / "still.csv", tumbling(frames=1))
    header, row = (tmp_path / "still.csv").read_text().splitlines()
    assert header.startswith("frame,time,pelvis_x,pelvis_y,pelvis_z,left_hip_x,")
    assert row.startswith("0,0.000000,0.300000,-0.200000,0.900000,")
