"""Preparing a folder of BVH files on one core, and a second start on the prepared store.

Reference: pybvh, a plain reader, to rotation matrices and joint positions of every frame, without our checks, axes and
store. The files hold random poses of the built-in body.
"""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import pybvh
import torch

from benchmarks.measuring import Effort, interleaved
from benchmarks.results import Comparison, Figure, Result
from benchmarks.subjects import body, poses
from motiongen.data.sources.bvh import read_bvh
from motiongen.data.sources.folder import MotionFolder
from motiongen.data.store import ClipStore
from motiongen.export.scene import Scene
from motiongen.export.write import write
from motiongen.motion.bodies import makehuman

TITLE = "Preparing a BVH folder"


def plain_reader(paths: list[Path]) -> list[np.ndarray]:
    """Joint positions (T, J, 3) of every file."""
    found = []
    for path in paths:
        motion = pybvh.read_bvh_file(path, world_up="+y")
        motion.to_rotmat()
        found.append(motion.joint_positions())
    return found


def measure(effort: Effort) -> list[Result]:
    files, frames = effort.size(12, 2), effort.size(300, 8)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with tempfile.TemporaryDirectory() as folder:
            return _measured(Path(folder), files, frames, effort)
    finally:
        torch.set_num_threads(threads)


def _measured(folder: Path, files: int, frames: int, effort: Effort) -> list[Result]:
    paths = [folder / f"{number}.bvh" for number in range(files)]
    for number, path in enumerate(paths):
        write(path, Scene(path.stem, poses(frames, seed=number), makehuman()))
    (folder / "labels.csv").write_text("file,tags\n" + "".join(f"{path.name},walk\n" for path in paths))
    source = MotionFolder(root=str(folder), skeleton=body(1).skeleton)
    attempts = iter(range(10**6))

    def prepare() -> None:
        ClipStore.open(source, folder / f"cache{next(attempts)}")

    plain = plain_reader(paths[:1])[0]
    ours = read_bvh(paths[0]).world()[1].numpy()
    error = float(np.abs(ours - plain).max() / np.abs(plain).max())
    taken = interleaved({"reference": partial(plain_reader, paths), "ours": prepare}, effort)
    again = interleaved({"again": lambda: ClipStore.open(source, folder / "cache0")}, effort)["again"]
    return [
        Comparison(
            f"{files} files of {frames} frames",
            **taken,
            error=error,
            tolerance=1e-5,
            target=3.0,
            made=(files * frames, "frames"),
        ),
        Figure("a second start", again.median, "s", "under 2 s"),
    ]
