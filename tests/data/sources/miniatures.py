"""Data sets of a few seconds in the layouts of the real ones, made from motion that is known in closed form."""

from __future__ import annotations

import json
import os
import pickle
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import joblib
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from torch import Tensor

from motiongen.motion.bodies import makehuman
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.skeleton import JOINT, PARENTS, Skeleton

Array = NDArray[np.float64]

CAMERA_FROM_WORLD = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Of a level camera that looks along y: its y points down, its z away."""
FIGURE = makehuman().skeleton.offsets.double().numpy()


@dataclass(frozen=True)
class Known:
    """A person who turns and drifts evenly, each joint about an axis of its own: known also between frames."""

    seed: int

    def turns(self, times: Array) -> Array:
        """(T, 24, 3) axis angles; z is up, and with zero yaw the person faces -y."""
        rng = np.random.default_rng(self.seed)
        axes = rng.normal(size=(24, 3))
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        angles = rng.uniform(-0.25, 0.25, 24) + rng.uniform(-0.15, 0.15, 24) * times[:, None]
        turns = angles[..., None] * axes
        yaw = rng.uniform(-3, 3) + 0.4 * times
        upright = Rotation.from_rotvec(yaw[:, None] * [0, 0, 1]) * Rotation.from_rotvec([np.pi / 2, 0, 0])
        turns[:, 0] = upright.as_rotvec()
        return turns

    def pelvis(self, times: Array) -> Array:
        """(T, 3) metres"""
        rng = np.random.default_rng(self.seed + 1)
        return rng.uniform(-1, 1, 3) + times[:, None] * rng.uniform(-0.5, 0.5, 3)

    def joints(self, times: Array, offsets: Array = FIGURE) -> Array:
        """(T, J, 3) metres, of 22 or of SMPL's 24 joints."""
        return joints(self.turns(times), self.pelvis(times), offsets)


def joints(turns: Array, pelvis: Array, offsets: Array) -> Array:
    """Forward kinematics by chains of 3x3 matrices, joint by joint."""
    rotations = Rotation.from_rotvec(turns.reshape(-1, 3)).as_matrix().reshape(*turns.shape, 3)
    world, places = [rotations[:, 0]], [pelvis]
    for joint, parent in enumerate((*PARENTS[1:], 20, 21)[: len(offsets) - 1], start=1):
        places.append(places[parent] + world[parent] @ offsets[joint])
        world.append(world[parent] @ rotations[:, joint])
    return np.stack(places, axis=1)


def check_upright(features: Tensor, skeleton: Skeleton, expected: Array) -> None:
    """Whether joints are where they were, to a tenth of a millimetre but for the floor, which no camera knows."""
    found = joint_positions(features.double(), skeleton).numpy()
    on_the_floor = expected - [0.0, 0.0, expected[..., 2].min() - 0.025]
    np.testing.assert_allclose(found, on_the_floor, atol=1e-4)
    assert (found[:, JOINT["head"], 2] > found[:, JOINT["pelvis"], 2] + 0.3).all()


class Attack:
    """Leaves a file behind where it is unpickled by the standard library."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, ("touch attacked",)


def times(frames: int, rate: float) -> Array:
    return np.arange(frames) / rate


def in_camera(turns: Array, view: Array = CAMERA_FROM_WORLD) -> Array:
    """Axis angles with the pelvis in another world than the one whose z is up, flat: (T, 72)."""
    seen = turns.copy()
    seen[:, 0] = (Rotation.from_matrix(view) * Rotation.from_rotvec(turns[:, 0])).as_rotvec()
    return seen.reshape(len(turns), -1)


def amass(motion: Known, frames: int, rate: float, rest_pelvis: Array, layout: str = "smplh") -> dict[str, Any]:
    """The fields of a file of SMPL-H or SMPL-X parameters."""
    when = times(frames, rate)
    turns, trans = motion.turns(when).reshape(frames, -1), motion.pelvis(when) - rest_pelvis
    common = {"trans": trans, "betas": np.zeros(16), "gender": np.array(b"male" if layout == "smplh" else "male")}
    if layout == "smplh":
        poses = np.concatenate([turns[:, :66], np.zeros((frames, 90))], axis=1)
        return common | {"poses": poses, "dmpls": np.zeros((frames, 8)), "mocap_framerate": np.array(rate)}
    return common | {
        "root_orient": turns[:, :3],
        "pose_body": turns[:, 3:66],
        "pose_hand": np.zeros((frames, 90)),
        "mocap_frame_rate": np.array(rate),
        "surface_model_type": np.array("smplx"),
        "markers_latent_vids": np.array({"head": 1}, dtype=object),
    }


def save_npz(path: Path, fields: dict[str, Any]) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, **fields)
    return path


def label(
    words: str, categories: Iterable[str] | None, start: float | None = None, end: float | None = None
) -> dict[str, Any]:
    row = {"seg_id": words, "raw_label": words.title(), "proc_label": words, "act_cat": categories and list(categories)}
    return row if start is None else row | {"start_t": start, "end_t": end}


def entry(
    path: str, seconds: float, frame: list[dict[str, Any]] | None, sequence: list[dict[str, Any]] | None = None
) -> dict[str, Any]:
    """One recording in train.json or val.json."""
    return {
        "babel_sid": 1,
        "url": "https://example.org",
        "feat_p": path,
        "dur": seconds,
        "seq_ann": sequence and {"labels": sequence},
        "frame_ann": frame and {"labels": frame},
    }


def save_babel(root: Path, **files: dict[str, dict[str, Any]]) -> Path:
    for name, content in {"train": {}, "val": {}, **files}.items():
        path = root / "babel_v1.0_release" / f"{name}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(content))
    return root


def babel_corpus(root: Path) -> Path:
    """Six recordings to train on and two to test, of three actions each."""
    files: dict[str, dict[str, Any]] = {"train": {}, "val": {}}
    for number in range(8):
        folder = "BMLrub/BioMotionLab_NTroje/rub001"
        save_npz(root / "amass" / folder / f"{number}_poses.npz", amass(Known(number), 240, 60.0, np.zeros(3)))
        labels = [label("walk", ["walk"], 0, 1.3), label("transition", ["transition"], 1.3, 1.5)]
        labels += [label("kick", ["kick"], 1.5, 2.7), label("stand", ["stand"], 2.7, 4.0)]
        files["train" if number < 6 else "val"][str(number)] = entry(f"{folder}/{number}_poses.npz", 4.0, labels)
    return save_babel(root, **files)


def smpl_corpus(root: Path) -> Path:
    """Six files each of two actions by two people whose shapes lie beside them, as in AMASS."""
    for number in range(12):
        folder = root / f"rub{number % 2:03d}" / ("walk", "kick")[number // 6]
        save_npz(folder / f"{number}_poses.npz", amass(Known(number), 120, 60.0, np.zeros(3)))
        save_npz(folder.parent / "shape.npz", {"betas": np.zeros(16)})
    return root


def humanact12(clips: list[tuple[Known, int]], offsets: Array, frames: int) -> dict[str, list[Any]]:
    """Clips and their labels; `offsets` (24, 3)."""
    when = times(frames, 30.0)
    seen = [
        (in_camera(motion.turns(when)), motion.joints(when, offsets) @ CAMERA_FROM_WORLD.T, number)
        for motion, number in clips
    ]
    return {field: [clip[place] for clip in seen] for place, field in enumerate(("poses", "joints3D", "y"))}


def save_pickle(path: Path, content: object) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps(content))
    return path


def humanact12_corpus(root: Path) -> Path:
    clips = [(Known(number), number % 2 + 1) for number in range(40)]
    save_pickle(root / "humanact12poses.pkl", humanact12(clips, np.concatenate([FIGURE, FIGURE[-2:]]), 40))
    return root


def vibe(turns: Array, pelvis: Array, view: Array = CAMERA_FROM_WORLD) -> dict[str, Array]:
    """What VIBE stores of a person whose pelvis it sees at (T, 3) in the world; the other joints are noise."""
    places = np.random.default_rng(0).normal(size=(len(turns), 49, 3))
    places[:, 8] = pelvis @ view.T
    return {"pose": in_camera(turns, view).astype(np.float32), "joints3d": places.astype(np.float32)}


@dataclass(frozen=True)
class Video:
    """A video of UESTC."""

    motion: Known
    name: str
    frames: int
    turned: float = 0.0
    """Radians about the camera's y axis by which the view is turned from the front"""


def save_uestc(root: Path, videos: list[Video], classes: int = 40) -> Path:
    """The body stays where VIBE puts it, at one place; the path is in the other file, as in the real ones."""
    cache: dict[str, list[Array]] = {"pose": [], "joints3d": [], "orig_cam": [], "betas": []}
    paths = []
    for video in videos:
        when = times(video.frames, 30.0)
        view = Rotation.from_rotvec([0.0, video.turned, 0.0]).as_matrix() @ CAMERA_FROM_WORLD
        pelvis = video.motion.pelvis(when)
        still = np.tile([0.1, -0.2, 0.3], (video.frames, 1))
        for field, value in vibe(video.motion.turns(when), still, view).items():
            cache[field].append(value)
        cache["orig_cam"].append(np.ones((video.frames, 4)))
        cache["betas"].append(np.zeros((video.frames, 10)))
        paths.append((pelvis - still) @ view.T)
    save_pickle(root / "vibe_cache_refined.pkl", cache)
    save_pickle(root / "globtrans_usez.pkl", paths)
    (root / "info").mkdir()
    for name, lines in {
        "names": [video.name for video in videos],
        "num_frames_min": [str(video.frames) for video in videos],
        "action_classes": [f"exercise {number}" for number in range(classes)],
    }.items():
        (root / "info" / f"{name}.txt").write_text("\n".join(lines) + "\n")
    return root


def uestc_corpus(root: Path) -> Path:
    """Two actions of three subjects that train (1, 2, 6) and three that are tested (3, 4, 5)."""
    videos = [
        Video(Known(10 * subject + action), f"a{action}_d0_p{subject:03d}_c1_color.avi", 60)
        for subject in range(1, 7)
        for action in (0, 7)
    ]
    return save_uestc(root, videos)


def save_ntu13(root: Path, files: dict[str, Any], compress: int = 0) -> Path:
    for name, content in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        joblib.dump(content, root / name, compress=compress)
    (root / "ntu_vibe_list.txt").write_text("\n".join(files) + "\n")
    return root


def ntu13_corpus(root: Path) -> Path:
    when = times(40, 30.0)
    people = [(performer, action) for performer in range(15) for action in (7, 99)]
    return save_ntu13(
        root,
        {
            f"vibe/S001C001P{performer:03d}R001A{action:03d}.pkl": {
                1: vibe(Known(10 * performer + action).turns(when), np.zeros((40, 3)))
            }
            for performer, action in people
        },
    )
