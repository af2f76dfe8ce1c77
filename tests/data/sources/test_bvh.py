from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pybvh
import pytest

from motiongen.data.roots import DataError
from motiongen.data.sources.bvh import read_bvh
from tests.data.sources.bvh_files import Joint, positions_of, write_bvh

CLIP = "Bandai-Namco-Research-Motiondataset-1/data/dataset-1_bow_angry_001.bvh"


def figure() -> Joint:
    """Joints with positions and rotations in several orders, one without positions, one without channels."""
    hand = Joint("Hand", (0.0, 2.0, 0.5), ("Yrotation", "Zposition", "Xrotation", "Xposition"))
    arm = Joint("Arm", (1.0, 2.0, 3.0), ("Zrotation", "Xrotation", "Yrotation"), [hand])
    bar = Joint("Bar", (0.5, 0.0, 0.25), (), [Joint("Tip", (0.0, 1.0, 0.0), ("Xrotation",))])
    return Joint("Root", (9.0, 9.0, 9.0), ("Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation"), [arm, bar])


@pytest.fixture
def path(tmp_path: Path) -> Path:
    width = sum(len(joint.channels) for joint in figure().walk())
    values = np.random.default_rng(0).uniform(-180, 180, (7, width))
    values[2, 3] = -0.0
    values[3, 4] = 5e-7
    return write_bvh(tmp_path / "figure.bvh", figure(), values)


def greatest_difference(path: Path) -> float:
    bvh = read_bvh(path)
    positions = bvh.world()[1].numpy()
    expected = positions_of(path)
    assert set(bvh.names) == set(expected)
    return max(float(np.abs(positions[:, i] - expected[name]).max()) for i, name in enumerate(bvh.names))


def test_positions_agree_with_a_plain_loop(path: Path) -> None:
    assert greatest_difference(path) < 1e-9


def test_positions_of_a_real_clip_agree_with_a_plain_loop(shared_data: Path) -> None:
    assert greatest_difference(shared_data / "bandai_namco" / CLIP) < 1e-8


def test_positions_of_a_real_clip_agree_with_pybvh(shared_data: Path, tmp_path: Path) -> None:
    """pybvh takes positions at the root only; below joint_Root and Hips they equal the offsets, so they can be dropped.

    The root's channels, which pybvh does read, become those of both, as joint_Root stands still in this clip.
    """
    lines = (shared_data / "bandai_namco" / CLIP).read_text().splitlines()
    start = lines.index("MOTION")
    values = np.loadtxt(lines[start + 3 :]).reshape(-1, 22, 6)
    bvh = read_bvh(shared_data / "bandai_namco" / CLIP)
    joints = [Joint(name, tuple(offset.tolist())) for name, offset in zip(bvh.names, bvh.offsets, strict=True)]
    for joint, parent in zip(joints, bvh.parents, strict=True):
        if parent > 0:
            joint.channels = joint.channels[3:]
            joints[parent].children.append(joint)
    assert not values[:, 0].any()
    order = [joints.index(joint) for joint in joints[1].walk()]
    rest = values[:, order[1:], 3:].reshape(len(values), -1)
    plain = write_bvh(tmp_path / "plain.bvh", joints[1], np.concatenate([values[:, 1], rest], axis=1))
    other = pybvh.read_bvh_file(plain, world_up="+y")
    expected = other.joint_positions()
    positions = bvh.world()[1].numpy()
    for name in bvh.names[1:]:
        ours = positions[:, bvh.names.index(name)]
        assert np.abs(ours - expected[:, other.joint_names.index(name)]).max() < 1e-4, name


def test_header_facts(path: Path) -> None:
    bvh = read_bvh(path)
    assert bvh.names == ("Root", "Arm", "Hand", "Bar", "Tip")
    assert bvh.parents == (-1, 0, 1, 0, 3)
    assert bvh.offsets[2].tolist() == [0.0, 2.0, 0.5]
    assert bvh.fps == pytest.approx(30, abs=1e-3)


def lines_changed(change: Callable[[list[str]], list[str]]) -> Callable[[str], str]:
    return lambda text: "\n".join(change(text.split("\n")))


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (lambda text: text[: text.rindex("\n", 0, -200)], r":\d+: Frames: 7 promised, \d lines found; is the file cut"),
        (lambda text: text.rstrip()[:-60], r":\d+: frame 6: \d+ values, not 13"),
        (lambda text: text[: text.index("MOTION")], ":.*: MOTION: the section is missing; is the file cut"),
        (lambda text: text[: text.index("Bar")] + "\nMOTION\n", ": HIERARCHY: .*ends too early"),
        (lambda text: text[: text.index("Frames:")], ":.*: Frames: expected with a number, found ''"),
        (lambda text: text.replace("Frame Time: 0.0", "Frame Time: -0.0"), ":.*: Frame Time: -0.03.* not positive"),
        (lambda text: text.replace("CHANNELS 3 Z", "CHANNELS 3 W"), ":.*: HIERARCHY: CHANNELS: unknown channel 'Wrot"),
        (lambda text: text.replace("OFFSET 1.0", "OFFSET one"), ":.*: HIERARCHY: OFFSET: could not convert"),
        (lambda text: text.replace("JOINT Arm", "BONE Arm"), ":.*: HIERARCHY: BONE: unexpected 'BONE'"),
        (lines_changed(lambda lines: [*lines[:-2], lines[-2] + " 1"]), r":\d+: frame 6: 14 values, not 13"),
        (
            lines_changed(lambda lines: [*lines[:-3], "nan" + lines[-3][lines[-3].index(" ") :], *lines[-2:]]),
            r":\d+: frame 5: value 0: 'nan'",
        ),
        (lines_changed(lambda lines: [*lines[:-2], "x" + lines[-2]]), r":\d+: frame 6: value 0: 'x.*' is no finite"),
        (lambda text: "\0\xff" * 90, "MOTION"),
    ],
)
def test_damage_is_named_with_file_line_and_field(path: Path, damage: Callable[[str], str], complaint: str) -> None:
    path.write_text(damage(path.read_text()))
    with pytest.raises(DataError, match=complaint) as caught:
        read_bvh(path)
    assert str(caught.value).startswith(f"{path}:")
