"""UESTC RGB-D (Ji et al. 2018) with the SMPL poses that ACTOR's authors estimated by VIBE: one action a video."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import roma
import torch

from motiongen.data.clips import DataError, Segment, Sequence, Side
from motiongen.data.roots import check_root
from motiongen.data.sources.arrays import per_frame, read_plain_pickle
from motiongen.data.sources.camera import upright, vibe_pelvis
from motiongen.data.sources.files import digest, read_text, required
from motiongen.motion.bodies import makehuman
from motiongen.motion.skeleton import JOINTS, Skeleton
from motiongen.options import PositiveInt

PARSER_VERSION = 1
"""Counted up whenever the same files give other features or labels, so that older stores are not taken for new ones."""

FPS = 30.0
VIDEO = re.compile(r"a(\d{1,3})_d(\d{1,3})_p(\d{3})_c(\d{1,3})_color\.avi", re.ASCII)
FRAMES = re.compile(r"\d{1,9}", re.ASCII)
"""Action from 0, view, subject and side."""
SUBJECTS = 118
TRAINING_SUBJECTS = frozenset(
    (
        *(1, 2, 6, 12, 13, 16, 21, 24, 28, 29, 30, 31, 33, 35, 39, 41, 42, 45, 47, 50, 52, 54, 55, 57, 59, 61, 63, 64),
        *(67, 69, 70, 71, 73, 77, 81, 84, 86, 87, 88, 90, 91, 93, 96, 99, 102, 103, 104, 107, 108, 112, 113),
    )
)
"""Of the official cross-subject protocol; the other 67 are tested."""
FRONT, WHOLE_CIRCLE = 1, 8
"""The side whose views need no turn, and the view that is left out of the others: it goes round."""


@dataclass(frozen=True)
class _Video:
    index: int
    """Its place in all lists."""
    name: str
    frames: int
    action: int
    view: int
    subject: int
    side: int

    @property
    def turn(self) -> torch.Tensor:
        """(3, 3) about the camera's y axis, so that the view is from the front"""
        angle = 0.0 if self.side == FRONT else -self.view * math.pi / 4
        return roma.rotvec_to_rotmat(torch.tensor([0.0, angle, 0.0], dtype=torch.float64))


class Uestc:
    """The folder with `vibe_cache_refined.pkl`, `globtrans_usez.pkl`, `info/`, from ACTOR's repository (Mathux/ACTOR).

    Split as the official cross-subject protocol has it: 51 subjects are trained on, 67 are tested. The pelvis is where
    VIBE has it, moved by the estimated path of the body. Bones are those of the built-in figure, since VIBE's 49 joints
    lack those of the back.

    Args:
        root: the folder.
        min_training_frames: shorter videos are not trained on; 45 are 75% of ACTOR's 60. Tests keep all.

    Raises:
        DataError: when constructed, if a file is missing or `info/` is damaged; from `sequences`, if another file is.
    """

    name = "uestc"
    root_tags: frozenset[str] = frozenset()

    def __init__(self, *, root: str, min_training_frames: PositiveInt = 45) -> None:
        self._root = check_root(root)
        self._poses, self._paths = (
            required(self._root / name) for name in ("vibe_cache_refined.pkl", "globtrans_usez.pkl")
        )
        self._shortest = min_training_frames
        self._tags = self._lines("action_classes.txt")
        self._videos = self._listed()
        self._skeleton = makehuman().skeleton

    def fingerprint(self) -> str:
        files = [self._poses, self._paths, *sorted((self._root / "info").glob("*.txt"))]
        bones = self._skeleton.offsets.tolist()
        return digest(self._root, files, self.name, PARSER_VERSION, self._shortest, bones)

    def skeleton(self) -> Skeleton:
        return self._skeleton

    def __len__(self) -> int:
        return len(self._videos)

    def sequences(self) -> Iterator[Sequence]:
        content = read_plain_pickle(self._poses)
        if not isinstance(content, dict):
            raise DataError(f"{self._poses}: holds a {type(content).__name__}, not a dictionary")
        poses, joints = (self._per_video(self._poses, content.get(name), name) for name in ("pose", "joints3d"))
        paths = self._per_video(self._paths, read_plain_pickle(self._paths), "globtrans")
        for video in self._videos:
            where = f"{self._poses}: {video.name}"
            turns = per_frame(where, {"pose": poses[video.index]}, "pose", 3 * JOINTS)
            pelvis = vibe_pelvis(where, joints[video.index])
            path = per_frame(f"{self._paths}: {video.name}", {"globtrans": paths[video.index]}, "globtrans", 3)
            if not len(turns) == len(pelvis) == len(path):
                raise DataError(f"{where}: {len(turns)} poses, {len(pelvis)} joints3d and {len(path)} globtrans")
            root = roma.rotmat_to_rotvec(video.turn @ roma.rotvec_to_rotmat(turns[:, :3]))
            turns = torch.cat([root, turns[:, 3:]], dim=1)[: video.frames]
            pose = upright(where, turns, ((pelvis + path) @ video.turn.T)[: video.frames], self._skeleton, FPS)
            segment = Segment(0, len(pose), (self._tags[video.action],))
            yield Sequence(video.name, f"p{video.subject:03d}", pose, (segment,), _side(video))

    def _per_video(self, file: Path, values: Any, field: str) -> list[Any]:
        count = len(self._lines("names.txt"))
        if not isinstance(values, list) or len(values) != count:
            raise DataError(f"{file}: {field!r} is not a list of an entry for each of the {count} names")
        return values

    def _listed(self) -> list[_Video]:
        names, frames = self._lines("names.txt"), self._lines("num_frames_min.txt")
        info = self._root / "info"
        if len(names) != len(frames):
            raise DataError(f"{info / 'num_frames_min.txt'}: {len(frames)} numbers for {len(names)} names")
        videos = []
        for index, (name, number) in enumerate(zip(names, frames, strict=True)):
            match = VIDEO.fullmatch(name)
            if match is None or not int(match[1]) < len(self._tags) or not 1 <= int(match[3]) <= SUBJECTS:
                raise DataError(f"{info / 'names.txt'}:{index + 1}: {name!r:.100} is not the name of a video")
            if FRAMES.fullmatch(number) is None:
                raise DataError(f"{info / 'num_frames_min.txt'}:{index + 1}: {number!r:.100} is not a number of frames")
            video = _Video(index, name, int(number), *map(int, match.groups()))
            goes_round = video.side != FRONT and video.view == WHOLE_CIRCLE
            too_short = _side(video) == "train" and video.frames < self._shortest
            if not goes_round and not too_short and video.frames:
                videos.append(video)
        return videos

    def _lines(self, name: str) -> list[str]:
        return read_text(self._root / "info" / name, errors="strict").splitlines()


def _side(video: _Video) -> Side:
    return "train" if video.subject in TRAINING_SUBJECTS else "test"
