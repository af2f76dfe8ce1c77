"""Biovision Hierarchy (BVH) files: any joint may carry position channels, and these replace its OFFSET."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from motiongen.data.roots import DataError
from motiongen.data.sources.files import LARGEST_VALUE, is_finite, read_text

MOST_JOINTS = 1000
MOST_POSES = 2 * 10**7
"""Joints times frames: an hour of 66 joints at 84 Hz."""
FRAME_TIMES = (1e-4, 2.0)
"""Seconds"""


@dataclass(frozen=True)
class Bvh:
    """A parsed file, in the file's own axes and units."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    """Parent of every joint, -1 for a root; a parent always comes before its children. End sites are left out."""
    offsets: Tensor
    """(J, 3) float64"""
    rotations: Tensor
    """(T, J, 3, 3) float64, local; in memory the frames come last"""
    positions: Tensor
    """(T, J, 3) float64, local: the position channels where a joint has them, else its offset"""
    fps: float

    def world(self) -> tuple[Tensor, Tensor]:
        """World rotations (T, J, 3, 3) and joint positions (T, J, 3)."""
        # With the frames last, a product of small matrices is a few long sums, several times faster than T products.
        turns, places = self.rotations.movedim(0, -1), self.positions.movedim(0, -1)
        local = torch.cat([turns, places.unsqueeze(2)], dim=2).numpy()  # (J, 3, 4, T)
        world = np.empty_like(local)
        for joint, parent in enumerate(self.parents):
            if parent < 0:
                world[joint] = local[joint]
            else:
                np.einsum("ijt,jkt->ikt", world[parent, :, :3], local[joint], out=world[joint])
                world[joint, :, 3] += world[parent, :, 3]
        found = torch.from_numpy(world).movedim(-1, 0)
        return found[..., :3], found[..., 3]


@dataclass(eq=False)
class _Joint:
    name: str
    parent: int
    offset: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    channels: list[str] = field(default_factory=list)


def read_bvh(path: Path) -> Bvh:
    """Read a file.

    Raises:
        DataError: the file is cut, has a frame line with a wrong number of values, holds values that are not finite
            numbers, or is no BVH file; the message names the file, the line and the field.
    """
    lines = read_text(path).rstrip().splitlines()
    start = next((number for number, line in enumerate(lines) if line.strip() == "MOTION"), None)
    if start is None:
        raise DataError(f"{path}:{len(lines)}: MOTION: the section is missing; is the file cut?")
    joints = _hierarchy(path, lines[:start])
    frames = _setting(path, lines, start + 1, "Frames:")
    frame_time = _setting(path, lines, start + 2, "Frame Time:")
    if frame_time <= 0:
        raise DataError(f"{path}:{start + 3}: Frame Time: {frame_time} is not positive")
    if not FRAME_TIMES[0] <= frame_time <= FRAME_TIMES[1]:
        raise DataError(f"{path}:{start + 3}: Frame Time: {frame_time} s is no recording's")
    if frames * len(joints) > MOST_POSES:
        raise DataError(f"{path}:{start + 2}: Frames: {frames:.0f} of {len(joints)} joints are too many; cut the file")
    values = _frame_values(path, lines, start + 3, frames, sum(len(joint.channels) for joint in joints))
    rotations, positions = _local_pose(joints, values)
    return Bvh(
        names=tuple(joint.name for joint in joints),
        parents=tuple(joint.parent for joint in joints),
        offsets=torch.tensor([joint.offset for joint in joints], dtype=torch.float64),
        rotations=rotations,
        positions=positions,
        fps=1 / frame_time,
    )


def _hierarchy(path: Path, lines: list[str]) -> list[_Joint]:
    joints: list[_Joint] = []
    open_blocks: list[_Joint] = []
    named = _Joint("", -1)
    words = ((number, word) for number, line in enumerate(lines, start=1) for word in line.split())
    for number, word in words:
        try:
            if word in ("ROOT", "JOINT"):
                parent = joints.index(open_blocks[-1]) if open_blocks else -1
                named = _Joint(_next(words), parent)
                joints.append(named)
                if len(joints) > MOST_JOINTS:
                    raise ValueError(f"more than {MOST_JOINTS} joints")
            elif word == "End":
                named = _Joint(_next(words), -1)
            elif word == "{":
                open_blocks.append(named)
            elif word == "}":
                open_blocks.pop()
            elif word == "OFFSET":
                open_blocks[-1].offset = [_number(_next(words)) for _ in range(3)]
            elif word == "CHANNELS":
                open_blocks[-1].channels = [_channel(_next(words)) for _ in range(int(_next(words)))]
            elif word != "HIERARCHY":
                raise ValueError(f"unexpected {word!r:.40}")
        except (ValueError, IndexError, StopIteration) as error:
            raise DataError(
                f"{path}:{number}: HIERARCHY: {word:.40}: {str(error)[:200] or 'the section ends too early'}"
            ) from error
    if open_blocks or not joints:
        raise DataError(f"{path}:{len(lines)}: HIERARCHY: the section ends too early")
    names = [joint.name for joint in joints]
    if twice := [name for name in names if names.count(name) > 1]:
        raise DataError(f"{path}: HIERARCHY: joint {twice[0]:.60} is there twice")
    return joints


def _next(words: Iterator[tuple[int, str]]) -> str:
    return next(words)[1]


def _number(word: str) -> float:
    if not is_finite(word):
        # float says it of what is no number at all.
        raise ValueError(f"{float(word)} is no finite number")
    return float(word)


def _channel(word: str) -> str:
    if word[:1] not in ("X", "Y", "Z") or word[1:] not in ("position", "rotation"):
        raise ValueError(f"unknown channel {word!r:.40}")
    return word


def _setting(path: Path, lines: list[str], index: int, name: str) -> float:
    line = " ".join(lines[index].split()) if index < len(lines) else ""
    try:
        return float(line.removeprefix(name) if line.startswith(name) else "")
    except ValueError:
        raise DataError(f"{path}:{index + 1}: {name} expected with a number, found {line!r:.60}") from None


def _frame_values(path: Path, lines: list[str], first: int, frames: float, channels: int) -> np.ndarray:
    rows = lines[first:]
    if len(rows) != frames or not rows:
        raise DataError(f"{path}:{len(lines)}: Frames: {frames:g} promised, {len(rows)} lines found; is the file cut?")
    try:
        values = np.loadtxt(rows, ndmin=2, comments=None)
    except ValueError:
        values = np.empty((0, 0))
    if values.shape == (frames, channels) and (np.abs(values) <= LARGEST_VALUE).all():
        return values
    for number, row in enumerate(rows, start=first + 1):
        words = row.split()
        if len(words) != channels:
            raise DataError(f"{path}:{number}: frame {number - first - 1}: {len(words)} values, not {channels}")
        for column, word in enumerate(words):
            if not is_finite(word):
                raise DataError(
                    f"{path}:{number}: frame {number - first - 1}: value {column}: {word!r:.40} is no finite number"
                )
    raise DataError(f"{path}:{first + 1}: frames cannot be read as numbers")


def _local_pose(joints: list[_Joint], values: np.ndarray) -> tuple[Tensor, Tensor]:
    """Rotations (T, J, 3, 3) and positions (T, J, 3) from the channel values (T, C) in the order of the header."""
    channels = torch.from_numpy(values).T.contiguous()
    frames = len(values)
    positions = torch.tensor([joint.offset for joint in joints], dtype=torch.float64).unsqueeze(-1).repeat(1, 1, frames)
    rotations = torch.eye(3, dtype=torch.float64).unsqueeze(-1).repeat(len(joints), 1, 1, frames)
    sources_of: dict[str, list[list[int]]] = {}
    turned: dict[str, list[int]] = {}
    column = 0
    for index, joint in enumerate(joints):
        order, sources = "", []
        for channel in joint.channels:
            if channel.endswith("position"):
                positions[index, "XYZ".index(channel[0])] = channels[column]
            else:
                order += channel[0]
                sources.append(column)
            column += 1
        if order:
            sources_of.setdefault(order, []).append(sources)
            turned.setdefault(order, []).append(index)
    # Joints that share an order of axes are converted together.
    for order, sources_of_joints in sources_of.items():
        rotations[turned[order]] = _intrinsic_rotations(order, channels[torch.tensor(sources_of_joints)])
    return rotations.movedim(-1, 0), positions.movedim(-1, 0)


def _intrinsic_rotations(order: str, degrees: Tensor) -> Tensor:
    """Matrices (J, 3, 3, T) that turn by angles (J, len(order), T), one after another, about axes that turn along."""
    radians = torch.deg2rad(degrees)
    sines, cosines = radians.sin(), radians.cos()
    columns = list(torch.eye(3, dtype=torch.float64).unsqueeze(-1))
    for place, axis in enumerate(order):
        first, second = (("XYZ".index(axis) + step) % 3 for step in (1, 2))
        sine, cosine, one, other = sines[:, None, place], cosines[:, None, place], columns[first], columns[second]
        columns[first], columns[second] = cosine * one + sine * other, cosine * other - sine * one
    return torch.stack(torch.broadcast_tensors(*columns), dim=2)
