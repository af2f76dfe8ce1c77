from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from motiongen.data.clips import DataError, Sequence
from motiongen.data.sources.bandai import BandaiNamco
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.skeleton import FEET, JOINT, JOINT_NAMES
from tests.data.sources.bvh_files import Joint, positions_of, write_bvh

ONE, TWO = (f"Bandai-Namco-Research-Motiondataset-{number}" for number in (1, 2))
NOTES = """clip,in_subset,kind,note
dataset-2_walk_normal_007,1,overlap,shares frames with dataset-2_run_normal_020
dataset-2_run_normal_020,1,multi-action,"frames 0..9 are frames 60..69 of dataset-2_run_normal_030, cut"
dataset-2_walk_proud_003,1,mislabelled,left out of every split
"""


def write_clip(root: Path, folder: str, name: str, content: object, frames: int = 8) -> None:
    """Two joints for all 22: the test's mapping only needs names that the file has."""
    hips = Joint("Hips", (0.0, 93.0, -3.0), children=[Joint("Spine", (15.0, 0.0, 0.0))])
    values = np.random.default_rng(sum(name.encode())).uniform(-20, 20, (frames, 18))
    write_bvh(root / folder / "data" / f"{name}.bvh", Joint("joint_Root", (0.0, 0.0, 0.0), children=[hips]), values)
    (root / folder / "data" / f"{name}.json").write_text(json.dumps({"content": content, "style": 0}))


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """The data set's layout with a handful of clips."""
    joints = [
        {
            "index": index,
            "smpl": name,
            "bvh": None if name == "spine2" else "Hips" if index == 0 else "Spine",
            "rest_m": [0.0, 0.01 * index, 0.0],
            "align": np.eye(3).tolist(),
        }
        for index, name in enumerate(JOINT_NAMES)
    ]
    (tmp_path / "smpl22_mapping.json").write_text(json.dumps({"joints": joints}))
    (tmp_path / "clip_notes.csv").write_text(NOTES)
    for folder, labels in ((ONE, ["walk", "bow"]), (TWO, ["run", "walk"])):
        (tmp_path / folder / "cfg").mkdir(parents=True)
        lines = [f"dataset-{folder[-1]}_{label}" for label in labels]
        (tmp_path / folder / "cfg" / "content_label.txt").write_text("\n".join(lines) + "\n")
    for name, content in (("bow_sad_001", 1), ("walk_sad_001", 0), ("walk_sad_002", 0), ("walk_sad_004", 0)):
        write_clip(tmp_path, ONE, f"dataset-1_{name}", content)
    for name in ("walk_normal_007", "walk_proud_003", "run_normal_020", "run_normal_030"):
        write_clip(tmp_path, TWO, f"dataset-2_{name}", 1 if name.startswith("walk") else 0)
    return tmp_path


def by_name(source: BandaiNamco) -> dict[str, Sequence]:
    sequences = {sequence.name: sequence for sequence in source.sequences()}
    assert len(sequences) == len(source)
    return sequences


def test_both_parts_share_tags_and_unusable_clips_are_left_out(root: Path) -> None:
    tags = {name: sequence.segments[0].tags for name, sequence in by_name(BandaiNamco(root=str(root))).items()}
    assert tags == {
        "dataset-1_bow_sad_001": ("bow",),
        "dataset-1_walk_sad_001": ("walk",),
        "dataset-1_walk_sad_002": ("walk",),
        "dataset-1_walk_sad_004": ("walk",),
        "dataset-2_walk_normal_007": ("walk",),
        "dataset-2_run_normal_020": ("run",),
        "dataset-2_run_normal_030": ("run",),
    }


def test_the_style_is_the_one_that_the_file_name_carries(root: Path) -> None:
    styles = {name: sequence.segments[0].styles for name, sequence in by_name(BandaiNamco(root=str(root))).items()}
    assert styles["dataset-1_walk_sad_004"] == ("sad",)
    assert styles["dataset-2_run_normal_020"] == ("normal",)


def test_neighbouring_takes_and_clips_that_share_frames_are_one_group(root: Path) -> None:
    groups = {name: sequence.group for name, sequence in by_name(BandaiNamco(root=str(root))).items()}
    assert groups["dataset-1_walk_sad_001"] == groups["dataset-1_walk_sad_002"]
    assert groups["dataset-2_walk_normal_007"] == groups["dataset-2_run_normal_020"]
    assert groups["dataset-2_run_normal_020"] == groups["dataset-2_run_normal_030"]
    assert len(set(groups.values())) == 4


def test_the_fingerprint_follows_content(root: Path, tmp_path: Path) -> None:
    before = BandaiNamco(root=str(root)).fingerprint()
    assert BandaiNamco(root=str(root)).fingerprint() == before
    write_clip(root, TWO, "dataset-2_walk_proud_003", 1, frames=9)
    assert BandaiNamco(root=str(root)).fingerprint() == before, "this clip is not used"
    write_clip(root, TWO, "dataset-2_walk_normal_007", 0)
    assert BandaiNamco(root=str(root)).fingerprint() != before


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (lambda root: write_clip(root, ONE, "dataset-1_bow_sad_001", 2), "bow_sad_001.json: content: 2 is not a line"),
        (
            lambda root: write_clip(root, ONE, "dataset-1_bow_sad_001", -1),
            "bow_sad_001.json: content: -1 is not a line",
        ),
        (
            lambda root: write_clip(root, ONE, "dataset-1_bow_sad_001", "1"),
            "bow_sad_001.json: content: '1' is not a line",
        ),
        (
            lambda root: (root / ONE / "data/dataset-1_bow_sad_001.json").unlink(),
            "bow_sad_001.json: the file is missing",
        ),
        (
            lambda root: (root / ONE / "data/dataset-1_bow_sad_001.json").write_text("{"),
            "bow_sad_001.json: not a JSON file",
        ),
        (lambda root: (root / ONE / "cfg/content_label.txt").unlink(), "content_label.txt: the file is missing"),
        (lambda root: (root / "smpl22_mapping.json").write_text("[]"), "smpl22_mapping.json: joints: TypeError"),
        (
            lambda root: (root / "smpl22_mapping.json").write_text('{"joints": []}'),
            "mapping.json: joints: not SMPL's 22",
        ),
        (
            lambda root: (root / "clip_notes.csv").write_text("clip,kind\na,b\n"),
            "clip_notes.csv: column 'note' is missing",
        ),
        (lambda root: (root / "manifest.csv").write_text("path\ngone.bvh\n"), "gone.bvh: the file is missing"),
        (lambda root: write_clip(root, ONE, "bow", 1), "bow.bvh: the name is not dataset-"),
    ],
)
def test_what_is_wrong_is_named_at_once(root: Path, damage: Callable[[Path], object], complaint: str) -> None:
    damage(root)
    with pytest.raises(DataError, match=complaint):
        BandaiNamco(root=str(root))


def test_a_missing_or_empty_folder_is_named(tmp_path: Path, root: Path) -> None:
    with pytest.raises(DataError, match=r"data\.source\.root: folder .*absent does not exist"):
        BandaiNamco(root=str(tmp_path / "absent"))
    for path in root.glob("*/data/*.bvh"):
        path.unlink()
    with pytest.raises(DataError, match=r"no \.bvh files in"):
        BandaiNamco(root=str(root))


def test_a_cut_clip_is_named(root: Path) -> None:
    path = root / TWO / "data" / "dataset-2_run_normal_020.bvh"
    path.write_text(path.read_text()[:-900])
    with pytest.raises(DataError, match=r"run_normal_020\.bvh:.*Frames: 8 promised"):
        by_name(BandaiNamco(root=str(root)))


def real(shared_data: Path, tmp_path: Path, *names: str) -> dict[str, Sequence]:
    """A folder of links to a few real clips, read as a data set."""
    source = shared_data / "bandai_namco"
    for name in ("smpl22_mapping.json", "clip_notes.csv", f"{ONE}/cfg", f"{TWO}/cfg"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).symlink_to(source / name)
    for name in names:
        for suffix in (".bvh", ".json"):
            link = tmp_path / (ONE if name.startswith("dataset-1") else TWO) / "data" / f"{name}{suffix}"
            link.parent.mkdir(exist_ok=True)
            link.symlink_to(source / link.relative_to(tmp_path))
    return by_name(BandaiNamco(root=str(tmp_path)))


@pytest.mark.parametrize(
    ("name", "tolerance"),
    [
        ("dataset-1_dash_proud_001", 1e-5),
        ("dataset-2_wave-left-hand_normal_001", 1e-5),
        # This clip's right thigh and shank differ from all others' by 0.4 mm; joint_Root carries its travel.
        ("dataset-1_walk_normal_002", 5e-4),
    ],
)
def test_joints_of_the_features_are_the_file_s(shared_data: Path, tmp_path: Path, name: str, tolerance: float) -> None:
    sequence = real(shared_data, tmp_path, name)[name]
    rows = json.loads((shared_data / "bandai_namco" / "smpl22_mapping.json").read_text())["joints"]
    expected = positions_of(tmp_path / (ONE if "dataset-1" in name else TWO) / "data" / f"{name}.bvh")
    ours = joint_positions(sequence.features, BandaiNamco(root=str(tmp_path)).skeleton()).numpy()
    for row in rows:
        if row["bvh"] is not None:
            x, y, z = 0.01 * expected[row["bvh"]].T
            difference = np.linalg.norm(ours[:, row["index"]] - np.stack([x, -z, y], axis=1), axis=1)
            assert difference.max() < tolerance, row["smpl"]


def test_real_clips_stand_upright_on_the_floor(shared_data: Path, tmp_path: Path) -> None:
    name = "dataset-1_bow_normal_001"
    sequence = real(shared_data, tmp_path, name)[name]
    joints = joint_positions(sequence.features, BandaiNamco(root=str(tmp_path)).skeleton())
    assert joints[0, JOINT["head"], 2] == pytest.approx(1.4, abs=0.1)
    assert joints[:, list(FEET), 2].amin() > 0.0
    assert joints[:, [JOINT["left_foot"], JOINT["right_foot"]], 2].median() == pytest.approx(0.042, abs=0.015)
    # Left is left: it faces -y at first, so left is +x.
    assert joints[0, JOINT["left_shoulder"], 0] > joints[0, JOINT["right_shoulder"], 0]
    # A bow brings the head forward and down.
    assert joints[:, JOINT["head"], 2].min() < joints[0, JOINT["head"], 2] - 0.1
    assert joints[:, JOINT["head"], 1].min() < joints[0, JOINT["head"], 1] - 0.1


def test_the_real_chains_and_overlaps_share_groups(shared_data: Path, tmp_path: Path) -> None:
    first = [f"dataset-2_walk-turn-{clip}" for clip in ("right_normal_004", "left_normal_005")]
    second = [f"dataset-2_walk-turn-{side}_normal_{take}" for side in ("left", "right") for take in ("028", "032")]
    alone = "dataset-2_walk-turn-left_normal_001"
    groups = {name: clip.group for name, clip in real(shared_data, tmp_path, *first, *second, alone).items()}
    assert len({groups[name] for name in first}) == 1
    assert len({groups[name] for name in second}) == 1
    assert len(set(groups.values())) == 3


def test_travel_of_joint_root_counts(root: Path) -> None:
    """The pelvis is joint_Root's translation plus Hips', whose offset is replaced."""
    name = "dataset-1_bow_sad_001"
    pose = by_name(BandaiNamco(root=str(root)))[name].features[:, -3:]
    x, y, z = 0.01 * positions_of(root / ONE / "data" / f"{name}.bvh")["Hips"].T
    assert torch.allclose(pose, torch.from_numpy(np.stack([x, -z, y], axis=1)).float(), atol=1e-6)
