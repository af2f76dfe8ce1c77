from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import roma
import torch

from motiongen.data.clips import DataError
from motiongen.data.sources.folder import MotionFolder
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import FEATURES, TRANSLATION, pack, unpack
from motiongen.motion.skeleton import JOINT_NAMES, JOINTS, PARENTS
from tests.compositions import skeleton


def folder(root: Path, **files: dict[str, np.ndarray]) -> MotionFolder:
    for name, arrays in files.items():
        np.savez(root / f"{name}.npz", **arrays)
    lines = ["file,tags", *(f"{name}.npz,walk + wave" for name in files)]
    (root / "labels.csv").write_text("\n".join(lines))
    return MotionFolder(root=str(root), skeleton=skeleton())


def motion(frames: int = 31) -> tuple[torch.Tensor, torch.Tensor]:
    draws = torch.Generator().manual_seed(0)
    return 0.3 * torch.randn(frames, JOINTS, 3, generator=draws), torch.randn(frames, 3, generator=draws)


def test_axis_angles_and_features_are_one_motion(tmp_path: Path) -> None:
    turns, pelvis = motion()
    hands = torch.zeros(len(turns), 90)
    packed = pack(roma.rotvec_to_rotmat(turns), pelvis)
    source = folder(
        tmp_path,
        amass={"poses": torch.cat([turns.flatten(1), hands], 1).numpy(), "trans": pelvis.numpy()},
        ours={"features": packed.numpy(), "fps": np.array(30.0), "tags": np.array(["walk"])},
    )
    amass, ours = source.sequences()
    assert torch.allclose(amass.features, packed, atol=1e-6)
    assert torch.allclose(ours.features, packed, atol=1e-6)
    assert amass.segments[0].tags == ("walk", "wave")


def test_other_rates_come_to_thirty_frames_a_second(tmp_path: Path) -> None:
    turns, pelvis = motion(121)
    arrays = {"poses": turns.flatten(1).numpy(), "trans": pelvis.numpy(), "mocap_framerate": np.array(120.0)}
    (found,) = folder(tmp_path, fast=arrays).sequences()
    assert len(found.features) == 31
    assert torch.allclose(found.features[:, TRANSLATION], pelvis[::4], atol=1e-5)


def test_bvh_in_centimetres_stands_where_its_positions_say(tmp_path: Path) -> None:
    """Against joints computed from the file's own offsets, one rotation at the left hip and the root on its way."""
    body = skeleton()
    lines = ["HIERARCHY"]

    def joint(number: int, depth: int) -> None:
        children = [child for child, parent in enumerate(PARENTS) if parent == number and child != number]
        offset = " ".join(f"{100 * value:.6f}" for value in body.offsets[number].tolist())
        lines.append(f"{'ROOT' if number == 0 else 'JOINT'} {JOINT_NAMES[number]}\n{{\nOFFSET {offset}")
        position = "Xposition Yposition Zposition " if number == 0 else ""
        lines.append(f"CHANNELS {6 if number == 0 else 3} {position}Zrotation Yrotation Xrotation")
        for child in children:
            joint(child, depth + 1)
        if not children:
            lines.append("End Site\n{\nOFFSET 0 0 0\n}")
        lines.append("}")
        order.append(number)

    order: list[int] = []
    joint(0, 0)
    frames = []
    for step in range(3):
        values = [10.0 * step, 90.0, 5.0, 0.0, 0.0, 0.0]
        values += [30.0 * step if number == 3 else 0.0 for number in range(3, 3 * JOINTS)]
        frames.append(" ".join(map(str, values)))
    lines += ["MOTION", "Frames: 3", "Frame Time: 0.0333333", *frames]
    (tmp_path / "take.bvh").write_text("\n".join(lines))
    (tmp_path / "labels.csv").write_text("file,tags\ntake.bvh,walk\n")
    (found,) = MotionFolder(root=str(tmp_path), skeleton=body).sequences()
    pelvis = unpack(found.features)[1]
    assert pelvis.tolist() == [pytest.approx([0.1 * step, -0.05, 0.9], abs=1e-5) for step in range(3)]
    joints = joint_positions(found.features, body)
    shin = joints[:, JOINT_NAMES.index("left_knee")] - joints[:, JOINT_NAMES.index("left_hip")]
    x, y, z = body.offsets[JOINT_NAMES.index("left_knee")].tolist()
    for step in range(3):
        turn = np.deg2rad(30.0 * step)  # about the file's z axis, before y up becomes z up
        turned = (x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), z)
        assert shin[step].tolist() == pytest.approx([turned[0], -turned[2], turned[1]], abs=1e-5)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"trans": np.zeros((5, 3))}, "field 'poses' is missing"),
        ({"poses": np.zeros((5, 66))}, "field 'trans' is missing"),
        ({"poses": np.zeros((5, 60)), "trans": np.zeros((5, 3))}, r"field 'poses' has shape \(5, 60\)"),
        ({"poses": np.zeros((5, 66)), "trans": np.zeros((4, 3))}, "'poses' has 5 frames and 'trans' 4"),
        (
            {"poses": np.zeros((5, 66)), "trans": np.zeros((5, 3)), "rest_pelvis": np.zeros((5, 3))},
            r"field 'rest_pelvis' has shape \(5, 3\)",
        ),
        ({"features": np.full((5, FEATURES), np.nan)}, "field 'features' is not finite at frame 0"),
        ({"poses": np.array([print], dtype=object)}, "field 'poses' is missing|not an NPZ file"),
    ],
)
def test_what_is_wrong_with_a_file_is_named(tmp_path: Path, arrays: dict[str, np.ndarray], message: str) -> None:
    with pytest.raises(DataError, match=rf"broken\.npz: .*({message})"):
        list(folder(tmp_path, broken=arrays).sequences())


def test_labels_that_cannot_be_used(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"labels\.csv: the file is missing"):
        MotionFolder(root=str(tmp_path), skeleton=skeleton())
    for text, message in (
        ("file\n", "column 'tags' is missing"),
        ("file,tags\n", "no files are listed"),
        ("file,tags\ngone.npz,walk\n", r"gone\.npz: the file is missing"),
        ("file,tags\n../outside.npz,walk\n", "lies outside the folder"),
    ):
        (tmp_path / "labels.csv").write_text(text)
        (tmp_path.parent / "outside.npz").write_bytes(b"")
        with pytest.raises(DataError, match=message):
            MotionFolder(root=str(tmp_path), skeleton=skeleton())
