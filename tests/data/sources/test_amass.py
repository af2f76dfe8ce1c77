from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motiongen.data.clips import DataError
from motiongen.data.sources.amass import LEG_LENGTH, REST_PELVIS, People, read_amass
from motiongen.errors import InputError
from motiongen.motion.bodies import makehuman
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.skeleton import JOINT
from tests.data.sources.miniatures import FIGURE, Known, amass, joints, save_npz, times
from tests.motion.bodies.test_smpl import model, write

SIZE = makehuman().skeleton.leg_length / LEG_LENGTH


@pytest.mark.parametrize("layout", ["smplh", "smplx"])
@pytest.mark.parametrize(
    ("rate", "expected"), [(120.0, 61), (120.00004577, 61), (100.0, 73), (59.94, 121), (59.0, 123), (30.0, 241)]
)
def test_joints_are_where_they_were_at_every_thirtieth_second(
    tmp_path: Path, layout: str, rate: float, expected: int
) -> None:
    motion, rest = Known(3), np.array(REST_PELVIS[layout])
    path = save_npz(tmp_path / "clip.npz", amass(motion, 241, rate, rest, layout))
    people = People(None)
    found = joint_positions(read_amass(path, people).double(), people.skeleton).numpy()
    assert len(found) == expected
    when = times(expected, 30.0)
    np.testing.assert_allclose(found, joints(motion.turns(when), SIZE * motion.pelvis(when), FIGURE), atol=1e-4)
    assert (found[:, JOINT["head"], 2] > found[:, JOINT["pelvis"], 2]).all()


@pytest.mark.parametrize(
    ("folder", "rate"), [("BMLhandball/S01_Expert", 240.0), ("SSM/20160930_50032", 59.0), ("SSM/20161014_50033", 59.0)]
)
def test_rates_that_are_known_to_be_wrong_are_corrected(tmp_path: Path, folder: str, rate: float) -> None:
    motion, rest = Known(0), np.array(REST_PELVIS["smplh"])
    path = save_npz(tmp_path / folder / "clip_poses.npz", amass(motion, 100, rate, rest))
    fields = dict(np.load(path)) | {"mocap_framerate": np.array(120.0)}
    people = People(None)
    found = joint_positions(read_amass(save_npz(path, fields), people).double(), people.skeleton).numpy()
    when = times(len(found), 30.0)
    assert when[-1] <= 99 / rate < when[-1] + 1 / 30
    np.testing.assert_allclose(found[:, 0], SIZE * motion.pelvis(when), atol=1e-4)


def test_with_smpl_s_own_files_every_person_has_their_own_pelvis_and_size(tmp_path: Path) -> None:
    """Against J0 = regressor @ (template + shapes @ betas) of the model of their gender."""
    arrays = {gender: model(52, seed) for seed, gender in enumerate(("neutral", "male"))}
    for gender, fields in arrays.items():
        (tmp_path / "bodies" / "smplh" / gender).mkdir(parents=True)
        write(tmp_path / "bodies" / "smplh" / gender / "model.npz", fields)
    betas = np.linspace(-1, 1, 10)
    male, mean = arrays["male"], arrays["neutral"]
    places = male["J_regressor"] @ (male["v_template"] + male["shapedirs"] @ betas)
    usual = mean["J_regressor"] @ mean["v_template"]
    fields = amass(Known(1), 60, 30.0, np.zeros(3)) | {"betas": betas}
    people = People(str(tmp_path / "bodies"))
    found = read_amass(save_npz(tmp_path / "clip.npz", fields), people)[:, -3:].numpy()
    scale = legs(usual) / legs(places)
    np.testing.assert_allclose(found, scale * (Known(1).pelvis(times(60, 30.0)) + places[0]), atol=1e-4)
    np.testing.assert_allclose(people.skeleton.offsets[1], usual[1] - usual[0], atol=1e-5)


def legs(places: Any) -> float:
    bones = [
        places[JOINT[f"{side}_{end}"]] - places[JOINT[f"{side}_{start}"]]
        for side in ("left", "right")
        for start, end in (("hip", "knee"), ("knee", "ankle"))
    ]
    return float(sum(np.linalg.norm(bone) for bone in bones) / 2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda fields: fields.pop("poses"), "field 'poses' is missing"),
        (lambda fields: fields.pop("trans"), "field 'trans' is missing"),
        (lambda fields: fields.pop("mocap_framerate"), "field 'mocap_framerate' is missing"),
        (lambda fields: fields.update(mocap_framerate=np.array(0.0)), "'mocap_framerate': 0.0 is not a frame rate"),
        (lambda fields: fields.update(mocap_framerate=np.array(np.nan)), "nan is not a frame rate"),
        (lambda fields: fields.update(mocap_framerate=np.array("fast")), "fast is not a frame rate"),
        (lambda fields: fields.update(poses=fields["poses"][:, :60]), r"field 'poses' has shape \(30, 60\)"),
        (lambda fields: fields.update(poses=fields["poses"][:9]), "9 frames of poses and 30 of 'trans'"),
        (lambda fields: fields["trans"].__setitem__((7, 1), np.nan), "field 'trans' is not finite at frame 7"),
        (lambda fields: fields.update(betas=np.full(16, np.inf)), "field 'betas' is not of finite numbers"),
        (lambda fields: fields.update(betas=np.array(["a"])), "field 'betas' is not of finite numbers"),
        (lambda fields: fields.update(gender=np.array("robot")), "a robot smplh body"),
        (lambda fields: fields.update(poses=np.array([print], dtype=object)), "not an NPZ file of plain arrays"),
        (lambda fields: fields.update(root_orient=np.zeros((30, 3))), "field 'pose_body' is missing"),
    ],
)
def test_what_is_wrong_with_a_file_is_named(
    tmp_path: Path, change: Callable[[dict[str, Any]], object], message: str
) -> None:
    fields = amass(Known(0), 30, 30.0, np.zeros(3))
    change(fields)
    with pytest.raises(DataError, match=rf"clip\.npz: .*{message}"):
        read_amass(save_npz(tmp_path / "clip.npz", fields), People(None))


def test_cut_files_are_named(tmp_path: Path) -> None:
    path = save_npz(tmp_path / "clip.npz", amass(Known(0), 30, 30.0, np.zeros(3)))
    whole = path.read_bytes()
    for share in (0, 0.3, 0.9):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(DataError, match=r"clip\.npz: not an NPZ file"):
            read_amass(path, People(None))


def test_missing_bodies_are_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"data\.source\.bodies: folder .*absent does not exist"):
        People(str(tmp_path / "absent"))
    with pytest.raises(InputError, match=r"there is no file .*neutral/model\.npz"):
        People(str(tmp_path))
