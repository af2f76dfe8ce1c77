"""No file makes a reader fail in a way that was not promised, take memory without bound, or leave half a store.

MOTIONGEN_FUZZ_EXAMPLES is how many files every reader gets, 60 by default.
"""

from __future__ import annotations

import io
import json
import os
import pickle
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_matrix

from motiongen import arrays
from motiongen.data.clips import DataError
from motiongen.data.sources.amc import read_amc
from motiongen.data.sources.bvh import MOST_JOINTS, Bvh, read_bvh
from motiongen.data.sources.bvh_folder import BvhFolder
from motiongen.data.sources.bvh_names import CONVENTIONS
from motiongen.data.sources.bvh_rig import read_mapping
from motiongen.data.sources.files import read_json
from motiongen.data.sources.folder import read_labels, read_motion
from motiongen.data.store import ClipStore
from motiongen.errors import InputError
from motiongen.generation.checkpoint import load_generator, save_generator
from motiongen.motion.bodies import Body, smpl
from motiongen.motion.representation import FEATURES
from motiongen.synthesis.timeline import Timeline, read_timeline
from tests.compositions import marionet
from tests.data.hostile import damaged
from tests.data.sources.rigs import RigFile, body, motion
from tests.motion.bodies.test_smpl import model

EXAMPLES = int(os.environ.get("MOTIONGEN_FUZZ_EXAMPLES", "60"))
MEMORY = 2**30
"""Bytes that a reader may take, whatever it reads."""
TAGS = ("bow", "kick", "run", "walk", "wave")
often = settings(
    max_examples=EXAMPLES,
    deadline=None,
    database=None,
    derandomize=EXAMPLES == 60,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large],
)


@pytest.fixture(autouse=True)
def bounded_memory() -> Iterator[None]:
    """Whoever asks for more gets a MemoryError, which no reader promises."""
    resource = pytest.importorskip("resource", reason="the platform does not bound memory")
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
    except OSError:
        pytest.skip("the platform does not tell how much memory is used")
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MEMORY, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@dataclass(frozen=True)
class Reader:
    """Something that reads a file of this name, and whether what it delivers is right."""

    file: str
    valid: Callable[[], bytes]
    read: Callable[[Path], Any]
    is_right: Callable[[Any], bool]


def as_npz(**content: Any) -> bytes:
    target = io.BytesIO()
    np.savez(target, **content)
    return target.getvalue()


def as_file(write: Callable[[Path], object], name: str) -> Callable[[], bytes]:
    @cache
    def content() -> bytes:
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            write(Path(folder) / name)
            return (Path(folder) / name).read_bytes()

    return content


def bvh(frames: int = 8) -> bytes:
    return as_file(lambda path: RigFile(CONVENTIONS["smpl"], unit=0.01).write(path, *motion(frames), body()), "a.bvh")()


def checkpoint() -> bytes:
    return as_file(lambda path: save_generator(path, generator(), TAGS, [("store", "take", 0, 9)]), "a.pt")()


@cache
def generator() -> Any:
    return marionet()


def is_motion(features: torch.Tensor) -> bool:
    return features.shape[1] == FEATURES and len(features) > 0 and bool(features.isfinite().all())


def is_bvh(found: Bvh) -> bool:
    tensors = (found.offsets, found.rotations, found.positions, *found.world())
    return len(set(found.names)) == len(found.names) and all(bool(one.isfinite().all()) for one in tensors)


def is_body(found: Body) -> bool:
    return all(bool(one.isfinite().all()) for one in (found.rest, found.weights, found.skeleton.offsets))


def is_timeline(found: Timeline) -> bool:
    return all(action.frames > 0 and action.tags for action in found.actions)


TIMELINE = {
    "actions": [{"tags": ["walk", "wave"], "seconds": 2, "path": [[0, 0], [1, 2.5]]}, {"tags": "sit", "seconds": 1.5}],
    "style": "sad",
    "seed": 3,
    "variants": 2,
}
SMALL = {name: array.astype(np.float32) if array.dtype.kind == "f" else array for name, array in model(24).items()}
MAPPING = {"up": "y", "metres": 0.01, "joints": dict(CONVENTIONS["smpl"]), "align": {}}
AMC = b"# made up\n:FULLY-SPECIFIED\n:DEGREES\n" + b"".join(
    b"%d\nroot 1 2 3 4.5 -6 7\narm 1.25 2 -3\nleg 5\n" % number for number in range(1, 6)
)

READERS = {
    "bvh": Reader("a.bvh", bvh, read_bvh, is_bvh),
    "motion as bvh": Reader("a.bvh", bvh, read_motion, is_motion),
    "amc": Reader(
        "a.amc",
        lambda: AMC,
        lambda path: read_amc(path, {"root": 6, "arm": 3, "leg": 1}),
        lambda found: all(bool(values.isfinite().all()) for values in found.values()),
    ),
    "poses": Reader(
        "a.npz",
        lambda: as_npz(poses=np.ones((5, 66)), trans=np.ones((5, 3)), mocap_framerate=np.array(60.0)),
        read_motion,
        is_motion,
    ),
    "features": Reader("a.npz", lambda: as_npz(features=np.ones((5, FEATURES)), fps=30.0), read_motion, is_motion),
    "body as npz": Reader("a.npz", lambda: as_npz(**SMALL), smpl, is_body),
    "body as pickle": Reader("a.pkl", lambda: pickle.dumps(SMALL, protocol=2), smpl, is_body),
    "timeline as yaml": Reader(
        "a.yaml", lambda: yaml.safe_dump(TIMELINE).encode(), lambda path: read_timeline(str(path)), is_timeline
    ),
    "timeline as json": Reader(
        "a.json", lambda: json.dumps(TIMELINE).encode(), lambda path: read_timeline(str(path)), is_timeline
    ),
    "labels": Reader(
        "labels.csv",
        lambda: b"file,tags\nlabels.csv,walk + wave\n./labels.csv,sit\n",
        read_labels,
        lambda found: all(all(tags) for tags in found.values()),
    ),
    "mapping": Reader("a.yaml", lambda: yaml.safe_dump(MAPPING).encode(), read_mapping, lambda found: len(found) == 4),
    "json": Reader("a.json", lambda: json.dumps(TIMELINE).encode(), read_json, lambda found: True),
    "checkpoint": Reader(
        "a.pt", checkpoint, lambda path: load_generator(path, generator(), TAGS), lambda found: isinstance(found, tuple)
    ),
}


def outcome(read: Callable[[Path], Any], path: Path) -> tuple[Any, str]:
    """What is delivered, or what the promised error says."""
    try:
        return read(path), ""
    except InputError as error:
        return None, str(error)


def check(reader: Reader, content: bytes, folder: Path) -> None:
    path = folder / reader.file
    path.write_bytes(content)
    found, complaint = outcome(reader.read, path)
    assert path.name in complaint or reader.is_right(found), "the file is not named"
    assert len(complaint) < 2000
    assert [one.name for one in folder.iterdir()] == [path.name]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", READERS)
@given(data=st.data())
@often
def test_a_reader_delivers_what_is_right_or_says_what_is_wrong(name: str, data: st.DataObject, tmp_path: Path) -> None:
    reader = READERS[name]
    check(reader, data.draw(damaged(reader.valid())), tmp_path)


@pytest.mark.parametrize("name", READERS)
def test_what_is_damaged_was_right_before(name: str, tmp_path: Path) -> None:
    reader = READERS[name]
    (tmp_path / reader.file).write_bytes(reader.valid())
    if name == "mapping":
        with pytest.raises(DataError, match="align"):
            reader.read(tmp_path / reader.file)
    else:
        assert reader.is_right(reader.read(tmp_path / reader.file))


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("content", [b"", b"\0" * 1000, b"\xff\xfe" + b"a" * 9, b"[" * 10**5, b"PK\5\6" + b"\0" * 18])
def test_files_of_no_format_are_refused(name: str, content: bytes, tmp_path: Path) -> None:
    check(READERS[name], content, tmp_path)


@pytest.mark.parametrize("name", READERS)
def test_folders_and_absent_files_are_refused(name: str, tmp_path: Path) -> None:
    reader = READERS[name]
    for path in (tmp_path / reader.file, tmp_path / ("long" * 100 + reader.file)):
        with pytest.raises(InputError, match=reader.file):
            reader.read(path)
    (tmp_path / reader.file).mkdir()
    with pytest.raises(InputError, match=reader.file):
        reader.read(tmp_path / reader.file)


@given(content=damaged(bvh(8)))
@settings(often, max_examples=max(1, EXAMPLES // 4))
def test_a_folder_of_bvh_gives_a_whole_store_or_none(content: bytes, tmp_path_factory: pytest.TempPathFactory) -> None:
    root = tmp_path_factory.mktemp("hostile")
    (root / "walk").mkdir()
    (root / "walk" / "a.bvh").write_bytes(content)
    store, complaint = outcome(lambda folder: ClipStore.open(BvhFolder(root=str(folder)), root / "cache"), root)
    left = [path.name for path in (root / "cache" / "clips").iterdir() if path.is_dir()]
    if complaint:
        assert "a.bvh" in complaint or "sequence walk/a" in complaint
        assert left == []
    else:
        assert is_motion(store.features(0))
        assert left == [store.folder.name]


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
