from __future__ import annotations

import csv
import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from torch import Tensor

from motiongen.data.clips import DataError
from motiongen.data.sources.cmu_mocap6 import CmuMocap6
from motiongen.data.splits import split
from motiongen.data.store import ClipStore
from motiongen.motion.kinematics import forward_kinematics, joint_positions
from motiongen.motion.skeleton import FEET, JOINT, JOINT_NAMES
from tests.data.sources.bvh_files import about

METRES = 2.54 / 0.45 / 100
HEAD = JOINT["head"]


@pytest.fixture(scope="module")
def root(shared_data: Path) -> Path:
    return shared_data / "cmu_mocap6"


@pytest.fixture(scope="module")
def store(root: Path, tmp_path_factory: pytest.TempPathFactory) -> ClipStore:
    return ClipStore.open(CmuMocap6(root=str(root)), tmp_path_factory.mktemp("cache"))


def recorded(root: Path, name: str, every: int) -> np.ndarray:
    """Joints (T, 22, 3) in metres, z up, of every `every`-th frame of an AMC file, by a loop over frames and bones."""
    skeleton = json.loads((root / "skeleton.json").read_text())
    blocks: list[dict[str, list[float]]] = []
    for line in (root / "amc" / f"{name}.amc").read_text().splitlines()[3:]:
        bone, *values = line.split()
        if values:
            blocks[-1][bone] = [float(value) for value in values]
        else:
            blocks.append({})

    def turn(angles: dict[str, float]) -> np.ndarray:
        parts = [about("xyz".index(axis), math.radians(angles.get(axis, 0.0)))[:3, :3] for axis in "zyx"]
        return parts[0] @ parts[1] @ parts[2]

    frames = []
    for block in blocks[::every]:
        rotation = {"root": turn(dict(zip("xyz", block["root"][3:], strict=True)))}
        position = {"root": np.array(block["root"][:3])}
        for bone, own in skeleton["joints"].items():
            axes = turn(dict(zip("xyz", own["axis_deg"], strict=True)))
            local = axes @ turn(dict(zip(own["dof"], block[bone], strict=True))) @ axes.T
            rotation[bone] = rotation[own["parent"]] @ local
            offset = np.array(own["offset"][name[:2]])
            position[bone] = position[own["parent"]] + rotation[own["parent"]] @ offset
        joints = METRES * np.array([position[skeleton["smpl22"][joint]] for joint in JOINT_NAMES])
        frames.append(np.stack([joints[:, 0], -joints[:, 2], joints[:, 1]], axis=1))
    return np.array(frames)


def features_of(store: ClipStore) -> dict[str, Tensor]:
    return {sequence.name: store.features(index) for index, sequence in enumerate(store.sequences)}


@pytest.mark.parametrize("name", ["13_30", "14_14"])
def test_joints_are_the_recording_s(root: Path, name: str) -> None:
    source = CmuMocap6(root=str(root))
    local, pelvis = source.pose(name)
    ours = forward_kinematics(local[::40], pelvis[::40], source.skeleton_of(name))[1].numpy()
    difference = np.linalg.norm(ours - recorded(root, name, every=40), axis=-1)
    # SMPL lacks the second of two neck joints, whose bend shortens the way to the head.
    assert difference[:, HEAD].max() < 0.01
    assert np.delete(difference, HEAD, axis=1).max() < 1e-5


@pytest.mark.parametrize("name", ["13_31", "14_20"])
def test_on_the_mean_skeleton_joints_stay_near_the_scaled_recording(root: Path, store: ClipStore, name: str) -> None:
    source = CmuMocap6(root=str(root))
    mean = source.skeleton()
    ours = joint_positions(features_of(store)[name][::10], mean).numpy()
    scale = mean.leg_length / source.skeleton_of(name).leg_length
    difference = np.linalg.norm(ours - scale * recorded(root, name, every=40), axis=-1)
    assert difference.mean() < 0.012
    assert difference.max() < 0.035


def test_feet_stand_on_the_floor(store: ClipStore) -> None:
    for features in features_of(store).values():
        feet = joint_positions(features, store.skeleton)[:, list(FEET)]
        still = (feet[1:] - feet[:-1]).norm(dim=-1) * 30 < 0.05
        ankle, toe = (feet[1:, [place, place + 2], 2][still[:, [place, place + 2]]] for place in (0, 1))
        assert 0.07 < ankle.median() < 0.10
        assert 0.025 < toe.median() < 0.06
        assert feet[..., 2].min() > 0


def test_the_zero_pose_is_smpl_s(root: Path) -> None:
    offsets = CmuMocap6(root=str(root)).skeleton().offsets
    for side, sign in (("left", 1), ("right", -1)):
        for joint in ("knee", "ankle"):
            bone = offsets[JOINT[f"{side}_{joint}"]]
            assert -bone[1] / bone.norm() > 0.99999
        for joint in ("elbow", "wrist"):
            bone = offsets[JOINT[f"{side}_{joint}"]]
            assert sign * bone[0] / bone.norm() > 0.99999
        foot = offsets[JOINT[f"{side}_foot"]]
        assert foot[2] / foot.norm() == pytest.approx(math.cos(math.radians(20)), abs=1e-4)


def test_knees_and_elbows_bend_about_one_axis(root: Path) -> None:
    """SMPL's knees flex about +x, its elbows about -y (left) and +y (right)."""
    local, _ = CmuMocap6(root=str(root)).pose("13_30")
    knee = local[:, [JOINT["left_knee"], JOINT["right_knee"]]]
    elbow = local[:, [JOINT["left_elbow"], JOINT["right_elbow"]]]
    assert (knee[..., 0, 0] - 1).abs().max() < 1e-6
    assert (elbow[..., 1, 1] - 1).abs().max() < 1e-6
    assert knee[..., 2, 1].median(dim=0).values.min() > 0.1
    assert elbow[:, 0, 2, 0].median() > 0.1
    assert elbow[:, 1, 0, 2].median() > 0.1


def test_segments_are_those_of_the_published_table(root: Path, store: ClipStore) -> None:
    with (root / "segments.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(store.sequences) == 5
    for sequence in store.sequences:
        expected = [row for row in rows if row["sequence"] == sequence.name]
        assert [segment.tags for segment in sequence.segments] == [(row["action"],) for row in expected]
        for segment, row in zip(sequence.segments, expected, strict=True):
            assert 4 * segment.start == int(row["start_frame_120hz"])
            assert 0 <= 4 * segment.stop - int(row["end_frame_120hz_exclusive"]) < 4
        assert sequence.segments[-1].stop == sequence.length


@pytest.mark.parametrize("seed", range(3))
def test_every_tag_that_is_kept_can_be_trained_and_tested(store: ClipStore, seed: int) -> None:
    result = split(store, seed, min_clips=2)
    assert set(result.left_out) == {"UpDown", "ToeTouchTwoHands"}
    sides = [{clip.sequence for clip in side} for side in (result.train, result.test)]
    assert not sides[0] & sides[1]
    for side in (result.train, result.test):
        tags = {store.sequences[clip.sequence].segments[clip.segment].tags[0] for clip in side}
        assert tags >= set(result.tags)


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (
            lambda root: (root / "truelabels/13_30.txt").write_text("1 13 1"),
            r"13_30.txt: label 1: '13' is none of 1, 2",
        ),
        (lambda root: (root / "truelabels/13_30.txt").write_text("1 1 1"), r"13_30.txt: 3 labels for 2465 frames"),
        (lambda root: (root / "truelabels/13_30.txt").unlink(), r"13_30.txt: the file is missing"),
        (lambda root: (root / "amc/13_30.amc").unlink(), r"13_30.amc: the file is missing"),
        (lambda root: shutil.rmtree(root / "truelabels") or shutil.rmtree(root / "amc"), r"no files amc"),
        (lambda root: (root / "skeleton.json").write_text('{"joints": 3}'), r"skeleton.json: KeyError: 'action_names'"),
        (lambda root: rename_subject(root), r"skeleton.json: joints: no offsets for subject 99 of 99_30"),
    ],
)
def test_what_is_wrong_is_named(root: Path, tmp_path: Path, damage: Callable[[Path], object], complaint: str) -> None:
    copy = tmp_path / "copy"
    for name in ("skeleton.json", "amc/13_30.amc", "truelabels/13_30.txt"):
        (copy / name).parent.mkdir(exist_ok=True, parents=True)
        (copy / name).write_bytes((root / name).read_bytes())
    damage(copy)
    with pytest.raises(DataError, match=complaint):
        list(CmuMocap6(root=str(copy)).sequences())


def rename_subject(root: Path) -> None:
    for file in ("amc/13_30.amc", "truelabels/13_30.txt"):
        (root / file).rename((root / file).with_stem("99_30"))


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"data\.source\.root: folder .*absent does not exist"):
        CmuMocap6(root=str(tmp_path / "absent"))
