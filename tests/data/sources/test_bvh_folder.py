from __future__ import annotations

import math
import os
import re
from pathlib import Path

import numpy as np
import pybvh
import pytest
import torch
import yaml
from torch import Tensor

from motiongen.data.clips import DataError
from motiongen.data.sources.bandai import BandaiNamco
from motiongen.data.sources.bvh_folder import BvhFolder
from motiongen.data.sources.bvh_names import CONVENTIONS
from motiongen.data.sources.retarget import WORLD_FROM_Y_UP
from motiongen.data.store import ClipStore
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import JOINT, JOINT_NAMES, JOINTS, Skeleton
from tests.data.sources.bvh_files import positions_of
from tests.data.sources.rigs import RigFile, a_pose, along_bones, body, motion

FEET = [JOINT[f"{side}_{name}"] for side in ("left", "right") for name in ("ankle", "foot")]
MIXAMO = {joint: f"mixamorig:{name}" for joint, name in CONVENTIONS["mixamo"].items()}
CMU_BETWEEN = {"left_hip": "LHipJoint", "right_hip": "RHipJoint", "head": "Neck1"}
RIGS = {
    "smpl": RigFile(CONVENTIONS["smpl"], unit=0.01),
    "mixamo": RigFile(MIXAMO, a_pose(), unit=0.01, order="XYZ"),
    "cmu": RigFile(CONVENTIONS["cmu"], unit=0.0254 / 0.45, order="ZYX", between=CMU_BETWEEN),
    "cmu, inches, z up": RigFile(
        CONVENTIONS["cmu"], a_pose() @ WORLD_FROM_Y_UP.T, up="z", unit=0.0254, between=CMU_BETWEEN
    ),
    "cmu, z up, its root always turned": RigFile(
        CONVENTIONS["cmu"], a_pose(), up="z", unit=0.0254, between=CMU_BETWEEN
    ),
    "lafan1": RigFile(CONVENTIONS["lafan1"], along_bones(), unit=0.01, order="ZYX"),
    "lafan1, metres, z up": RigFile(CONVENTIONS["lafan1"], along_bones(), up="z"),
    "bandai, millimetres": RigFile(CONVENTIONS["bandai"], along_bones(), unit=0.001),
}


def known(rig: RigFile) -> tuple[Tensor, Tensor]:
    """Motion that the rig can hold: joints that it lacks do not turn."""
    local, pelvis = motion()
    for joint, name in enumerate(JOINT_NAMES):
        if rig.names[name] is None:
            local[:, joint] = torch.eye(3)
    return local, pelvis


def written(rig: RigFile, root: Path) -> BvhFolder:
    rig.write(root / "walk" / "take.bvh", *known(rig), body())
    return BvhFolder(root=str(root))


def degrees_between(one: Tensor, other: Tensor) -> Tensor:
    cosine = ((one * other).sum(dim=(-1, -2)) - 1) / 2
    return torch.rad2deg(torch.acos(cosine.clamp(-1, 1)))


@pytest.mark.parametrize("name", RIGS)
def test_the_rotations_that_were_written_are_read(tmp_path: Path, name: str) -> None:
    rig = RIGS[name]
    (sequence,) = written(rig, tmp_path).sequences()
    rotations, pelvis = unpack(sequence.features.double())
    local, expected = known(rig)
    joints = [joint for joint in range(JOINTS) if joint not in FEET]
    assert degrees_between(rotations, local)[:, joints].max() < 0.1
    assert (pelvis - expected).abs().max() < 1e-4
    if "lafan1" not in name and "bandai" not in name:
        # Their zero pose shows how feet are held; for the others that is told from where they stand.
        assert degrees_between(rotations, local)[:, FEET].max() < 0.1


@pytest.mark.parametrize("name", RIGS)
def test_joints_are_where_another_reader_has_them(tmp_path: Path, name: str) -> None:
    rig = RIGS[name]
    source = written(rig, tmp_path)
    (sequence,) = source.sequences()
    found = joint_positions(sequence.features.double(), source.skeleton())
    other = pybvh.read_bvh_file(tmp_path / "walk" / "take.bvh", world_up=f"+{rig.up}")
    expected = torch.from_numpy(other.joint_positions()) * rig.unit
    if rig.up == "y":
        expected = torch.stack([expected[..., 0], -expected[..., 2], expected[..., 1]], dim=-1)
    for joint, given in rig.names.items():
        if given is not None:
            apart = (found[:, JOINT[joint]] - expected[:, other.joint_names.index(given)]).abs().max()
            assert apart < 1e-4, joint


def test_what_was_guessed_is_written_down_and_can_be_given(tmp_path: Path) -> None:
    RIGS["lafan1"].write(tmp_path / "data" / "walk" / "take.bvh", *motion(), body())
    source = BvhFolder(root=str(tmp_path / "data"), guesses=str(tmp_path / "guesses"))
    (sequence,) = source.sequences()
    (guess,) = (tmp_path / "guesses").iterdir()
    given = BvhFolder(root=str(tmp_path / "data"), mapping=str(guess))
    assert given.fingerprint() != source.fingerprint()
    assert torch.allclose(next(given.sequences()).features, sequence.features, atol=1e-6)
    content = yaml.safe_load(guess.read_text())
    assert (content["up"], content["metres"]) == ("y", 0.01)
    content["joints"]["head"] = "Crown"
    guess.write_text(yaml.safe_dump(content))
    with pytest.raises(DataError, match=r"take\.bvh: HIERARCHY: joint Crown is missing, which stands for head"):
        list(BvhFolder(root=str(tmp_path / "data"), mapping=str(guess)).sequences())


def test_settings_overrule_what_the_files_show(tmp_path: Path) -> None:
    written(RIGS["smpl"], tmp_path)
    (guessed,) = BvhFolder(root=str(tmp_path)).sequences()
    (half,) = BvhFolder(root=str(tmp_path), metres=0.005).sequences()
    assert torch.allclose(unpack(half.features)[1], unpack(guessed.features)[1] / 2, atol=1e-6)
    (tilted,) = BvhFolder(root=str(tmp_path), up="z").sequences()
    x, y, z = unpack(guessed.features)[1].T
    assert torch.allclose(unpack(tilted.features)[1], torch.stack([x, z, -y], dim=1), atol=1e-6)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"joints": {"pelvis": "Hips"}}, "joints: has to give a name for each of pelvis"),
        ({"joints": {**CONVENTIONS["smpl"], "head": None}}, "joints: head: None is no joint's name"),
        ({"joints": dict(CONVENTIONS["smpl"]), "up": "x"}, "up: 'x' is neither y nor z"),
        ({"joints": dict(CONVENTIONS["smpl"]), "metres": -1}, "metres: -1 is not a length"),
        ({"joints": dict(CONVENTIONS["smpl"]), "align": {"pelvis": 3}}, "align: KeyError"),
        (
            {"joints": dict(CONVENTIONS["smpl"]), "align": {joint: np.ones((3, 3)).tolist() for joint in JOINT_NAMES}},
            "align: not a rotation matrix",
        ),
        ({"joint": {}}, "joint: there is no such field"),
        ([], "not a set of fields"),
    ],
)
def test_what_is_wrong_with_a_mapping_is_named(tmp_path: Path, content: object, message: str) -> None:
    (tmp_path / "mapping.yaml").write_text(yaml.safe_dump(content))
    with pytest.raises(DataError, match=rf"mapping\.yaml: {message}"):
        BvhFolder(root=str(tmp_path), mapping=str(tmp_path / "mapping.yaml"))


def test_unknown_joints_ask_for_a_mapping(tmp_path: Path) -> None:
    names = {joint: f"bone{number}" for number, joint in enumerate(JOINT_NAMES)}
    RigFile(names).write(tmp_path / "walk" / "take.bvh", *motion(), body())
    with pytest.raises(DataError, match=r"take\.bvh: .* there is no .*; give data\.source\.mapping"):
        list(BvhFolder(root=str(tmp_path)).sequences())


def test_a_body_of_no_size_asks_for_the_unit(tmp_path: Path) -> None:
    RigFile(CONVENTIONS["smpl"], unit=300.0).write(tmp_path / "walk" / "take.bvh", *motion(), body())
    with pytest.raises(DataError, match=r"take\.bvh: .*give data\.source\.metres"):
        list(BvhFolder(root=str(tmp_path)).sequences())


def test_faster_files_are_resampled_by_time(tmp_path: Path) -> None:
    rig = RigFile(CONVENTIONS["smpl"], unit=0.01, fps=120.0)
    local, pelvis = motion(121)
    rig.write(tmp_path / "walk" / "take.bvh", local, pelvis, body())
    (sequence,) = BvhFolder(root=str(tmp_path)).sequences()
    rotations, where = unpack(sequence.features.double())
    assert len(rotations) == 31
    assert (where - pelvis[::4]).abs().max() < 1e-4
    assert degrees_between(rotations, local[::4]).max() < 0.1


def test_feet_of_small_and_tall_stand_on_one_floor(tmp_path: Path) -> None:
    local, pelvis = motion()
    for name, size in (("small", 0.8), ("tall", 1.2)):
        rig = RigFile(CONVENTIONS["smpl"], unit=0.01)
        rig.write(tmp_path / "walk" / f"{name}.bvh", local, pelvis * size, Skeleton(body().offsets * size))
    source = BvhFolder(root=str(tmp_path))
    small, tall = source.sequences()
    assert torch.allclose(small.features, tall.features, atol=1e-5)
    assert torch.allclose(source.skeleton().offsets, body().offsets, atol=1e-5)


def take(root: Path, *names: str) -> None:
    for name in names:
        RIGS["smpl"].write(root / name, *motion(40), body())


def test_tags_are_names_of_folders(tmp_path: Path) -> None:
    take(tmp_path, "walk/a.bvh", "deep/wave hand/b.BVH")
    assert {one.name: one.segments[0].tags for one in BvhFolder(root=str(tmp_path)).sequences()} == {
        "walk/a": ("walk",),
        "deep/wave hand/b": ("wave hand",),
    }


def test_a_pattern_tells_tag_style_and_group(tmp_path: Path) -> None:
    take(tmp_path, "s1_walk+wave_sad_1.bvh", "s1_walk_old_2.bvh", "odd.bvh")
    pattern = r"(?P<group>s\d)_(?P<tag>[^_]+)_(?P<style>[^_]+)_\d"
    store = ClipStore.open(BvhFolder(root=str(tmp_path), pattern=pattern), tmp_path / "cache", max_rejected=0.5)
    assert [(one.group, one.segments[0].tags, one.segments[0].styles) for one in store.sequences] == [
        ("s1", ("walk", "wave"), ("sad",)),
        ("s1", ("walk",), ("old",)),
    ]
    assert list(store.quarantine) == ["odd.bvh"]
    assert "data.source.pattern" in store.quarantine["odd.bvh"]
    for wrong in ("(", "no group"):
        with pytest.raises(DataError, match=r"data\.source\.pattern: "):
            BvhFolder(root=str(tmp_path), pattern=wrong)


def test_a_table_tells_tags(tmp_path: Path) -> None:
    take(tmp_path, "a.bvh", "b.bvh", "unlisted.bvh")
    (tmp_path / "labels.csv").write_text("file,tags\nb.bvh,walk + wave\na.bvh,sit\n")
    found = {one.name: one.segments[0].tags for one in BvhFolder(root=str(tmp_path)).sequences()}
    assert found == {"b": ("walk", "wave"), "a": ("sit",)}


def test_damaged_and_foreign_files_are_left_out(tmp_path: Path) -> None:
    root = tmp_path / "data"
    take(root, *(f"walk/{number}.bvh" for number in range(8)))
    (root / "walk" / "cut.bvh").write_text((root / "walk" / "1.bvh").read_text()[:-500])
    take(tmp_path, "outside.bvh")
    (root / "walk" / "link.bvh").symlink_to(tmp_path / "outside.bvh")
    store = ClipStore.open(BvhFolder(root=str(root)), tmp_path)
    assert len(store.sequences) == 8
    assert re.search(r"cut\.bvh:\d+: frame \d+: \d+ values, not 69", store.quarantine["walk/cut.bvh"])
    assert "leads out of the folder" in store.quarantine["walk/link.bvh"]


@pytest.mark.skipif(os.name == "nt", reason="file names are text there")
def test_names_that_are_not_text_do_no_harm(tmp_path: Path) -> None:
    take(tmp_path, "walk/a.bvh")
    os.rename(tmp_path / "walk", os.fsencode(tmp_path) + b"/w\xe4lk")
    store = ClipStore.open(BvhFolder(root=str(tmp_path)), tmp_path / "cache")
    assert (store.sequences[0].name, store.tags) == (r"w\udce4lk/a", (r"w\udce4lk",))


def test_real_clips_are_read_as_with_the_mapping_that_comes_with_them(shared_data: Path) -> None:
    """The guess is the same but for the feet: the slope of a level foot is measured, and toes keep their mean bend."""
    root = shared_data / "bandai_namco"
    part = root / "Bandai-Namco-Research-Motiondataset-2" / "data"
    pattern = r"dataset-\d_(?P<tag>[^_]+)_(?P<style>[^_]+)_\d+"
    guessed, given = BvhFolder(root=str(part), pattern=pattern), BandaiNamco(root=str(root))
    jobs = guessed.jobs()
    by_name = {job.name: job for job in given.jobs()}
    same = [joint for joint in range(JOINTS) if joint not in FEET]
    for job in (jobs[0], jobs[100], jobs[-1]):
        (ours,), (theirs,) = job.read(), by_name[Path(job.name).stem].read()
        assert (ours.segments, len(ours.features)) == (theirs.segments, len(theirs.features))
        apart = degrees_between(unpack(ours.features.double())[0], unpack(theirs.features.double())[0])
        assert apart[:, same].max() < 0.1
        assert apart[:, FEET].max() < 1.5
        found = joint_positions(ours.features.double(), guessed.skeleton())
        expected = positions_of(job.paths[0])
        for joint, name in CONVENTIONS["bandai"].items():
            if name is not None:
                x, y, z = expected[name].T / 100
                assert np.abs(found[:, JOINT[joint]].numpy() - np.stack([x, -z, y], axis=1)).max() < 1e-4 + 4e-4 * (
                    name == "LowerLeg_R"
                )
    assert math.isclose(guessed.rig.metres, 0.01)
