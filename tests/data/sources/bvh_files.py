"""BVH files that tests write, and a reader of their own: a plain loop over joints and frames."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

BANDAI_CHANNELS = ("Xposition", "Yposition", "Zposition", "Zrotation", "Xrotation", "Yrotation")


@dataclass
class Joint:
    name: str
    offset: tuple[float, float, float]
    channels: tuple[str, ...] = BANDAI_CHANNELS
    children: list[Joint] = field(default_factory=list)

    def lines(self, depth: int = 0) -> list[str]:
        tab = "\t" * depth
        inner = [
            f"{tab}\tOFFSET {' '.join(map(repr, self.offset))}",
            f"{tab}\tCHANNELS {len(self.channels)} {' '.join(self.channels)} ",
        ]
        for child in self.children:
            inner += child.lines(depth + 1)
        if not self.children:
            inner += [f"{tab}\tEnd Site", f"{tab}\t{{", f"{tab}\t\tOFFSET 0 0 0", f"{tab}\t}}"]
        return [f"{tab}{'JOINT' if depth else 'ROOT'} {self.name}", f"{tab}{{", *inner, f"{tab}}}"]

    def walk(self) -> list[Joint]:
        return [self, *(joint for child in self.children for joint in child.walk())]


def write_bvh(path: Path, root: Joint, frames: np.ndarray, frame_time: float = 1 / 30) -> Path:
    """Frames (T, C): the channels of all joints in the order of the header."""
    rows = [" ".join(f"{value:.17g}" for value in row) for row in frames]
    head = ["HIERARCHY", *root.lines(), "MOTION", f"Frames: {len(rows)}", f"Frame Time: {frame_time:.9f}"]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([*head, *rows]) + "\n")
    return path


def positions_of(path: Path) -> dict[str, np.ndarray]:
    """World positions (T, 3) of every joint by name, in the file's units."""
    words = path.read_text().split()
    motion = words.index("MOTION")
    place = 1

    def joint(parent: str | None) -> None:
        nonlocal place
        name = words[place + 1]
        place += 3
        own: dict[str, object] = {"parent": parent}
        if name != "Site":
            joints[name] = own
        while words[place] != "}":
            if words[place] == "OFFSET":
                own["offset"] = [float(word) for word in words[place + 1 : place + 4]]
                place += 4
            elif words[place] == "CHANNELS":
                count = int(words[place + 1])
                own["channels"] = words[place + 2 : place + 2 + count]
                place += 2 + count
            else:
                joint(name)
        place += 1

    joints: dict[str, dict[str, object]] = {}
    while place < motion:
        joint(None)
    frames = int(words[motion + 2])
    values = [float(word) for word in words[motion + 6 :]]
    found: dict[str, list[np.ndarray]] = {name: [] for name in joints}
    cursor = 0
    for _ in range(frames):
        world: dict[str, np.ndarray] = {}
        for name, own in joints.items():
            translation, turn = list(own["offset"]), np.eye(4)  # type: ignore[call-overload]
            for channel in own["channels"]:  # type: ignore[attr-defined]
                axis = "XYZ".index(channel[0])
                if channel.endswith("position"):
                    translation[axis] = values[cursor]
                else:
                    turn = turn @ about(axis, math.radians(values[cursor]))
                cursor += 1
            local = np.eye(4)
            local[:3, 3] = translation
            local = local @ turn
            world[name] = local if own["parent"] is None else world[str(own["parent"])] @ local
            found[name].append(world[name][:3, 3])
    assert cursor == len(values)
    return {name: np.array(rows) for name, rows in found.items()}


def about(axis: int, angle: float) -> np.ndarray:
    """A 4x4 rotation about a coordinate axis."""
    one, other = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(4)
    matrix[one, one] = matrix[other, other] = math.cos(angle)
    matrix[other, one] = math.sin(angle)
    matrix[one, other] = -math.sin(angle)
    return matrix
