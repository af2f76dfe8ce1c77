from __future__ import annotations

from pathlib import Path

import pytest

from motiongen.errors import InputError
from motiongen.export.formats import ENDINGS
from motiongen.export.write import ENCODERS, ExportError, write
from tests.export.motions import tumbling


def test_every_named_format_can_be_written(tmp_path: Path) -> None:
    assert {Path(f"motion{ending}").suffix for ending in ENDINGS.values()} == set(ENCODERS)
    for ending in ENDINGS.values():
        write(tmp_path / f"motion{ending}", tumbling(frames=2))
    assert {path.name for path in tmp_path.iterdir()} == {f"motion{ending}" for ending in ENDINGS.values()}


@pytest.mark.parametrize("suffix", list(ENCODERS))
def test_the_same_scene_gives_the_same_bytes(tmp_path: Path, suffix: str) -> None:
    for name in ("one", "two"):
        write(tmp_path / f"{name}{suffix}", tumbling(frames=2))
    assert (tmp_path / f"one{suffix}").read_bytes() == (tmp_path / f"two{suffix}").read_bytes()


def test_the_case_of_a_suffix_does_not_matter(tmp_path: Path) -> None:
    write(str(tmp_path / "MOTION.BVH"), tumbling(frames=2))
    assert (tmp_path / "MOTION.BVH").read_text().startswith("HIERARCHY")


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("motion.fbx", r"motion\.fbx: no format has the suffix '\.fbx'; known: \.bvh, \.csv, \.glb, \.mp4, \.npz"),
        ("motion.gbl", r"motion\.gbl: .*did you mean '\.glb'\?"),
        ("motion", r"motion: no format has the suffix ''"),
        ("absent/motion.bvh", r"motion\.bvh: there is no folder .*absent"),
    ],
)
def test_a_path_that_cannot_be_is_named(tmp_path: Path, name: str, told: str) -> None:
    with pytest.raises(ExportError, match=told) as caught:
        write(tmp_path / name, tumbling(frames=2))
    assert isinstance(caught.value, InputError)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_replaced_leaves_nothing_half_written(tmp_path: Path) -> None:
    (tmp_path / "motion.csv").mkdir()
    with pytest.raises(ExportError, match=r"motion\.csv: cannot be written: Is a directory"):
        write(tmp_path / "motion.csv", tumbling(frames=2))
    assert [path.name for path in tmp_path.iterdir()] == ["motion.csv"]
