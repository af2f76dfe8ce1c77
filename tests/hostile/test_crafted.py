"""Files that no chance would make: sizes that are claimed, bombs, and hierarchies that no recording has."""

from __future__ import annotations

import io
import json
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.sparse import csc_matrix

from motiongen import arrays
from motiongen.data.clips import DataError
from motiongen.data.sources.bvh import MOST_JOINTS, read_bvh
from motiongen.data.sources.bvh_rig import read_mapping
from motiongen.data.sources.files import read_table
from motiongen.data.sources.folder import read_motion
from motiongen.errors import InputError
from motiongen.motion.bodies import smpl
from motiongen.runs import completed
from motiongen.synthesis.timeline import read_timeline
from motiongen.weights import read_weights
from tests.hostile.motions import SMALL
from tests.hostile.runs import OVERRIDES, write_run


def lying_npz(shape: str, kind: str = "<f8") -> bytes:
    """One array that claims to be larger than it is."""
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as file:
        file.writestr("poses.npy", b"\x93NUMPY\1\0" + len(header).to_bytes(2, "little") + header.encode() + bytes(800))
    return target.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        lying_npz("(10000000000000, 66)"),
        lying_npz("(-1, 66)"),
        lying_npz("(4294967296, 4294967296, 4294967296)"),
        lying_npz("(10, 10)", "|O"),
        lying_npz("(1000000, 1000000)", "|V0"),
        lying_npz("(" * 3000 + ")" * 3000),
    ],
)
def test_claimed_sizes_are_not_believed(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(DataError, match=r"a\.npz"):
        read_motion(tmp_path / "a.npz")


def test_a_zip_bomb_is_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        target = io.BytesIO()
        np.save(target, np.zeros((10**5, 66)))
        archive.writestr("poses.npy", target.getvalue())
    monkeypatch.setattr(arrays, "LARGEST", 10**7)
    with pytest.raises(DataError, match=r"a\.npz: .* has 52800128 bytes, more than 10000000"):
        read_motion(tmp_path / "a.npz")


def nested(depth: int, name: Callable[[int], str], frames: int = 1) -> str:
    opened = "".join(
        f"{'JOINT' if level else 'ROOT'} {name(level)}\n{{\nOFFSET 0 1 0\nCHANNELS 0\n" for level in range(depth)
    )
    closed = "}\n" * depth
    return f"HIERARCHY\n{opened}{closed}MOTION\nFrames: {frames}\nFrame Time: 0.01\n" + "0\n" * frames


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (nested(MOST_JOINTS + 1, str), f"more than {MOST_JOINTS} joints"),
        (nested(100_000, str), f"more than {MOST_JOINTS} joints"),
        (nested(3, lambda level: "Hips"), "joint Hips is there twice"),
        (nested(900, str, frames=40_000), "are too many"),
        (nested(2, str).replace("0.01", "0"), "Frame Time: 0"),
        (nested(2, str).replace("0.01", "-0.01"), "Frame Time: -0.01"),
        (nested(2, str).replace("0.01", "nan"), "Frame Time: nan"),
        (nested(2, str).replace("0.01", "1e300"), "Frame Time: 1e"),
        (nested(2, str).replace("0.01", "1e-300"), "Frame Time: 1e"),
        (nested(2, str).replace("Frames: 1", "Frames: 1e9"), "Frames: "),
        (nested(2, str).replace("Frames: 1", "Frames: -1"), "Frames: "),
        (nested(2, str).replace("Frames: 1", "Frames: inf"), "Frames: "),
        (nested(2, str).replace("Frames: 1", "Frames: nan"), "Frames: "),
        (nested(2, str).replace("OFFSET 0 1", "OFFSET 0 inf"), "OFFSET: .*inf is no finite number"),
    ],
)
def test_hierarchies_and_counts_that_no_recording_has(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_text(text)
    with pytest.raises(DataError, match=rf"a\.bvh.*{message}"):
        read_bvh(tmp_path / "a.bvh")


def test_aliases_within_aliases_are_refused(tmp_path: Path) -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 10)]
    for read in (read_mapping, lambda path: read_timeline(str(path))):
        (tmp_path / "a.yaml").write_text("\n".join([*lines, "actions: *a9"]))
        with pytest.raises(InputError, match=r"a\.yaml"):
            read(tmp_path / "a.yaml")


def test_a_sparse_matrix_of_enormous_size_is_refused(tmp_path: Path) -> None:
    matrix = csc_matrix(SMALL["J_regressor"])
    matrix._shape = (10**7, 10**7)
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(SMALL | {"J_regressor": matrix}, protocol=2))
    with pytest.raises(InputError, match=r"a\.pkl: the field J_regressor is not an array"):
        smpl(tmp_path / "a.pkl")


def test_a_field_under_a_tag_that_is_not_its_own_is_refused(tmp_path: Path) -> None:
    """PyYAML raises whatever comes of it."""
    for text in ("!!int ''", "!!bool x", "!!timestamp x", "!!float ''", "0x" + "f" * 5000, '"\\ud800"'):
        for read in (read_mapping, lambda path: read_timeline(str(path))):
            (tmp_path / "a.yaml").write_text(f"up: {text}")
            with pytest.raises(InputError, match=r"a\.yaml"):
                read(tmp_path / "a.yaml")


def test_a_table_of_many_columns_takes_no_more_than_its_file(tmp_path: Path) -> None:
    """A dictionary of all columns for every row would have 10^10 entries."""
    header = ",".join(map(str, range(10**5)))
    (tmp_path / "a.csv").write_text(f"file,{header}\n" + "a\n" * 10**5)
    assert len(read_table(tmp_path / "a.csv", ("file",))) == 10**5


def test_weights_that_would_be_larger_than_their_file_are_refused(tmp_path: Path) -> None:
    packed = tmp_path / "a.pt"
    torch.save({"weight": torch.zeros(10**6)}, tmp_path / "plain.pt")
    with (
        zipfile.ZipFile(tmp_path / "plain.pt") as plain,
        zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for entry in plain.infolist():
            archive.writestr(entry.filename, plain.read(entry))
    assert packed.stat().st_size < 10**5
    with pytest.raises(ValueError, match="an entry is compressed"):
        read_weights(packed)
    torch.save({"weight": torch.zeros(10)}, packed, _use_new_zipfile_serialization=False)
    with pytest.raises(ValueError, match="BadZipFile"):
        read_weights(packed)


CODE = {
    "generator.encoder={_target_:os.system,command:'touch attacked'}": "names code",
    "generator.encoder._target_=os.system": "names code",
    "+objective.terms.x._target_=motiongen.tracking.summary.subprocess.Popen": "names code",
    "generator.encoder=${oc.create:{a:1}}": "makes a value by a function",
    "generator.encoder=${oc.decode:'{a: 1}'}": "makes a value by a function",
    "generator.encoder=${width:${oc.env:HOME}}": "makes a value by a function",
    "scale=../../../../tmp/evil": "names a file that is no option",
    "+experiment=/tmp/evil": "names a file that is no option",
    "+ablation=../../evil": "names a file that is no option",
    "generator/unroller/query=[../../evil]": "names a file that is no option",
}


@pytest.mark.parametrize("key", ["run", "resume"])
@pytest.mark.parametrize("override", CODE)
def test_a_run_of_a_stranger_names_no_code(tmp_path: Path, key: str, override: str) -> None:
    write_run(tmp_path)
    (tmp_path / ".hydra" / "overrides.yaml").write_text(json.dumps(["+experiment=actor", "trust=true", override]))
    with pytest.raises(InputError, match=rf"{key}: .*overrides\.yaml: .*{CODE[override]}.*add trust=true if"):
        completed([f"{key}={tmp_path}"])


def test_a_run_with_code_of_its_own_is_used_by_who_trusts_it(tmp_path: Path) -> None:
    write_run(tmp_path)
    overrides = ["+experiment=actor", "generator.encoder._target_=my.Encoder", "hydra.searchpath=[file:///evil]"]
    (tmp_path / ".hydra" / "overrides.yaml").write_text(json.dumps(overrides))
    kept = completed(["task=evaluate", f"run={tmp_path}", "trust=true"])
    assert kept[:-1] == [*overrides[:2], "task=evaluate", "trust=true"]
    typed = "generator.encoder._target_=my.Other"
    assert completed(["task=evaluate", f"run={tmp_path}", typed])[:-1] == [overrides[0], "task=evaluate", typed]
    (tmp_path / ".hydra" / "overrides.yaml").write_text(json.dumps(OVERRIDES))
    assert completed(["task=evaluate", f"run={tmp_path}"])[:-1] == [*OVERRIDES, "task=evaluate"]
