"""Readers of data sets: the files of small ones that are made from known motion."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from motiongen.data.clips import Source
from motiongen.data.sources.babel import RELEASE, Babel
from motiongen.data.sources.bandai import FOLDERS, BandaiNamco
from motiongen.data.sources.cmu_mocap6 import CmuMocap6
from motiongen.data.sources.humanact12 import FILE, HumanAct12
from motiongen.data.sources.ntu13 import LIST, Ntu13
from motiongen.data.sources.uestc import Uestc
from motiongen.motion.skeleton import JOINT_NAMES, PARENTS
from tests.data.sources.miniatures import (
    FIGURE,
    Known,
    Video,
    amass,
    entry,
    humanact12,
    label,
    save_babel,
    save_npz,
    save_ntu13,
    save_pickle,
    save_uestc,
    vibe,
)
from tests.hostile.motions import is_motion
from tests.hostile.reader import JSON, PICKLE, Reader

VIDEOS = [Video(Known(1), "a0_d0_p001_c1_color.avi", 6), Video(Known(2), "a7_d1_p003_c2_color.avi", 5)]
CLIP = "dataset-1_bow_sad_001"
MANIFEST = f"clip,path\none,{FOLDERS[0]}/data/{CLIP}.bvh\n"
NOTES = f"clip,in_subset,kind,note\n{CLIP},1,overlap,shares frames with {CLIP}\n"


def clips() -> dict[str, list[Any]]:
    offsets = np.concatenate([FIGURE, FIGURE[-2:]])
    return humanact12([(Known(0), 1), (Known(1), 2)], offsets, 5)


def write_humanact12(root: Path) -> None:
    save_pickle(root / FILE, clips())


def write_uestc(root: Path) -> None:
    save_uestc(root, VIDEOS, classes=8)


def video() -> dict[int, Any]:
    return {1: vibe(Known(3).turns(np.arange(6) / 30), np.zeros((6, 3)))}


def write_ntu13(root: Path) -> None:
    save_ntu13(root, {f"vibe/S001C001P00{number}R001A007.pkl": video() for number in (1, 2)})


def write_babel(root: Path) -> None:
    files: dict[str, dict[str, Any]] = {"train": {}, "val": {}}
    for number, name in enumerate(files):
        path = f"BMLrub/rub/{number}_poses.npz"
        save_npz(root / "amass" / path, amass(Known(number), 12, 60.0, np.zeros(3)))
        labels = [label("walk", ["walk"], 0, 0.1), label("kick", ["kick", "jump"], 0.05, 0.2)]
        files[name]["5"] = entry(path, 0.2, labels if number else None, [label("stand", ["stand"])])
    save_babel(root, **files)


def write_bandai(root: Path) -> None:
    """Without frames: what is read of clips is read of any BVH file."""
    rows = [
        {"index": index, "smpl": name, "bvh": None if name == "spine2" else "Hips", "rest_m": [0.0, 0.1, 0.0]}
        for index, name in enumerate(JOINT_NAMES)
    ]
    mapping = {"joints": [row | {"align": np.eye(3).tolist()} for row in rows]}
    (root / "smpl22_mapping.json").write_text(json.dumps(mapping))
    (root / "clip_notes.csv").write_text(NOTES)
    (root / "manifest.csv").write_text(MANIFEST)
    for folder in FOLDERS:
        (root / folder / "cfg").mkdir(parents=True)
        (root / folder / "cfg" / "content_label.txt").write_text("dataset-1_walk\ndataset-1_bow\n")
    (root / FOLDERS[0] / "data").mkdir()
    (root / FOLDERS[0] / "data" / f"{CLIP}.bvh").touch()
    (root / FOLDERS[0] / "data" / f"{CLIP}.json").write_text(json.dumps({"content": 1, "style": 0}))


def write_cmu(root: Path) -> None:
    """A skeleton whose bones bear the names of SMPL's joints, and twelve frames of it."""
    bones = {}
    for joint, (name, parent) in enumerate(zip(JOINT_NAMES, PARENTS, strict=True)):
        if parent >= 0:
            above = "root" if parent == 0 else JOINT_NAMES[parent]
            offset = (FIGURE[joint] / 0.0564).round(4).tolist()
            bones[name] = {"parent": above, "dof": "xyz", "axis_deg": [0, 10, 20], "offset": {"13": offset}}
    joints = {name: "root" if name == "pelvis" else name for name in JOINT_NAMES}
    skeleton = {"action_names": {"1": "Jog", "2": "Twist"}, "joints": bones, "smpl22": joints}
    (root / "skeleton.json").write_text(json.dumps(skeleton))
    lines = [line for n in range(1, 13) for line in (f"{n}", "root 0 17 0 1 2 3", *(f"{name} 1 2 3" for name in bones))]
    for folder in ("amc", "truelabels"):
        (root / folder).mkdir()
    (root / "amc" / "13_30.amc").write_text("\n".join([":DEGREES", *lines]) + "\n")
    (root / "truelabels" / "13_30.txt").write_text("1 2\n")


@cache
def files(write: Callable[[Path], object]) -> dict[str, bytes]:
    with TemporaryDirectory() as folder:
        write(Path(folder))
        paths = [path for path in Path(folder).rglob("*") if path.is_file()]
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def everything(make: Callable[..., Source], depth: int, path: Path) -> Any:
    """What the source has to say whose folder lies so many folders above the file."""
    source = make(root=str(path.parents[depth]))
    return source.fingerprint(), len(source), list(source.sequences())


def is_complete(found: Any) -> bool:
    fingerprint, _, sequences = found
    return len(fingerprint) == 64 and all(
        is_motion(one.features)
        and all(0 <= part.start < part.stop <= len(one.features) and part.tags for part in one.segments)
        for one in sequences
    )


def labels_alone(path: Path) -> Any:
    """Of the clips of Bandai-Namco, which are empty."""
    root = next(folder for folder in path.parents if (folder / FOLDERS[1]).is_dir())
    source = BandaiNamco(root=str(root))
    return source.fingerprint(), source.skeleton().offsets


def have_bones(found: Any) -> bool:
    return bool(found[1].isfinite().all())


def reader(
    write: Callable[[Path], object],
    make: Callable[..., Source],
    file: str,
    load: Callable[[bytes], Any] | None = None,
    also: tuple[str, ...] = (),
) -> Reader:
    """Of one file of a data set, in its form if there is one: what `load` takes apart is put together again."""
    form = {pickle.loads: PICKLE, json.loads: JSON}.get(load) if load else None
    content = partial(_content, write, file, load)
    read = partial(everything, make, file.count("/"))
    return Reader(file, content, read, is_complete, form, write, also)


def _content(write: Callable[[Path], object], file: str, load: Callable[[bytes], Any] | None) -> Any:
    content = files(write)[file]
    return load(content) if load else content


def bandai(file: str, load: Callable[[bytes], Any] | None = None) -> Reader:
    content = partial(_content, write_bandai, file, load)
    return Reader(file, content, labels_alone, have_bones, JSON if load else None, write_bandai)


UESTC = partial(Uestc, min_training_frames=1)
TRAIN = f"{RELEASE}/train.json"
LISTED = "vibe/S001C001P001R001A007.pkl"
READERS = {
    "humanact12": reader(write_humanact12, HumanAct12, FILE, pickle.loads),
    "uestc, poses": reader(write_uestc, UESTC, "vibe_cache_refined.pkl", pickle.loads),
    "uestc, paths": reader(write_uestc, UESTC, "globtrans_usez.pkl", pickle.loads, also=("vibe_cache_refined.pkl",)),
    "uestc, names": reader(write_uestc, UESTC, "info/names.txt", also=("num_frames_min.txt", "vibe_cache_refined.pkl")),
    "uestc, frames": reader(write_uestc, UESTC, "info/num_frames_min.txt"),
    "uestc, actions": reader(write_uestc, UESTC, "info/action_classes.txt", also=("names.txt",)),
    "ntu13, list": reader(write_ntu13, Ntu13, LIST, also=("the number after 'A'",)),
    "ntu13, joblib": reader(write_ntu13, Ntu13, LISTED),
    "ntu13, pickle": Reader(LISTED, video, partial(everything, Ntu13, 1), is_complete, PICKLE, write_ntu13),
    "babel": reader(write_babel, Babel, TRAIN, json.loads),
    "bandai, mapping": bandai("smpl22_mapping.json", json.loads),
    "bandai, notes": bandai("clip_notes.csv"),
    "bandai, manifest": bandai("manifest.csv"),
    "bandai, labels": bandai(f"{FOLDERS[0]}/cfg/content_label.txt"),
    "bandai, label": bandai(f"{FOLDERS[0]}/data/{CLIP}.json", json.loads),
    "cmu, skeleton": reader(write_cmu, CmuMocap6, "skeleton.json", json.loads, also=("13_30",)),
    "cmu, labels": reader(write_cmu, CmuMocap6, "truelabels/13_30.txt"),
    "cmu, motion": reader(write_cmu, CmuMocap6, "amc/13_30.amc", also=("13_30.txt",)),
}
