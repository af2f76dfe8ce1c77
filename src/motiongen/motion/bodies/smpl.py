"""SMPL, SMPL-H and SMPL-X model files that a user brings (Loper et al. 2015; Pavlakos et al. 2019).

The models' own licences do not allow them to be shipped, nor the `smplx` package to be required, so the files are read
directly: npz, and pickles without ever running what they contain.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray

from motiongen.arrays import read_npz
from motiongen.errors import InputError
from motiongen.files import is_file
from motiongen.motion.bodies.body import Body, SmplModel
from motiongen.motion.skeleton import JOINTS, PARENTS, Skeleton
from motiongen.unpickling import Inert, PlainUnpickler, RefusedPickle

Array = NDArray[np.float64]

FIELDS = ("v_template", "shapedirs", "posedirs", "J_regressor", "kintree_table", "weights", "f")
LARGEST_VALUE = 1e9
LEAST_WEIGHT = 1e-6
"""Of all joints together on a vertex; model files have 1."""
MOST_DENSE = 2**24
"""Entries of a matrix that is stored as a sparse one; SMPL-X's has a twentieth of them."""
SMPLH_JOINTS, SMPLX_JOINTS = 52, 55


class BodyFileError(InputError):
    """A body model file that cannot be used; the message names the file and the field."""


def smpl(
    path: str | Path, betas: Sequence[float] = (), gender: Literal["neutral", "female", "male"] = "neutral"
) -> Body:
    """The body part of an SMPL-family model: its first 22 joints; hand, jaw and eye weights go to wrists and head.

    Args:
        path: an npz or pickle (.pkl) model file with the fields of `FIELDS`.
        betas: shape coefficients, as many as wanted; the rest are zero.
        gender: whose model it is, which the file does not say; exported files name it.

    Raises:
        BodyFileError: the file is absent, not a model, incomplete, or holds objects that are not plain arrays.
    """
    path = Path(path)
    arrays = _read(path)
    template = _array(path, arrays, "v_template", (None, 3))
    count = len(template)
    shapes = _array(path, arrays, "shapedirs", (count, 3, None))
    poses = _array(path, arrays, "posedirs", (count, 3, None))
    tree = _array(path, arrays, "kintree_table", (2, None)).astype(np.int64)
    total = tree.shape[1]
    regressor = _array(path, arrays, "J_regressor", (total, count))
    weights = _array(path, arrays, "weights", (count, total))
    faces = _array(path, arrays, "f", (None, 3)).astype(np.int64)
    parents = _parents(path, tree)
    if weights.min() < 0 or weights.sum(axis=1).min() < LEAST_WEIGHT:
        raise BodyFileError(f"{path}: weights has a vertex that follows no joint, or flees from one")
    if poses.shape[2] < 9 * (JOINTS - 1):
        raise BodyFileError(f"{path}: posedirs has {poses.shape[2]} columns, fewer than {9 * (JOINTS - 1)}")
    if len(betas) > shapes.shape[2]:
        raise BodyFileError(f"{path}: {len(betas)} betas, but shapedirs has {shapes.shape[2]}")
    if faces.min() < 0 or faces.max() >= count:
        raise BodyFileError(f"{path}: f names vertices outside 0..{count - 1}")
    shaped = template + shapes[:, :, : len(betas)] @ np.asarray(betas, dtype=np.float64)
    joints = (regressor @ shaped)[:JOINTS]
    offsets = np.concatenate([np.zeros((1, 3)), joints[1:] - joints[list(PARENTS[1:])]])
    return Body(
        skeleton=Skeleton(_tensor(offsets)),
        faces=torch.from_numpy(faces),
        rest=_tensor(shaped - joints[0]),
        weights=_tensor(_body_weights(weights, parents)),
        # The columns of joints beyond the body stay out: hands at rest add nothing.
        pose_directions=_tensor(poses[:, :, : 9 * (JOINTS - 1)]),
        model=SmplModel(
            name="smplx" if total >= SMPLX_JOINTS else "smplh" if total >= SMPLH_JOINTS else "smpl",
            gender=gender,
            betas=tuple(map(float, betas)),
            rest_pelvis=(float(joints[0, 0]), float(joints[0, 1]), float(joints[0, 2])),
        ),
    )


def _parents(path: Path, tree: NDArray[np.int64]) -> list[int]:
    parents = [-1, *(int(parent) for parent in tree[0, 1:])]
    if tuple(parents[:JOINTS]) != PARENTS:
        raise BodyFileError(f"{path}: kintree_table does not begin with the 22 joints of SMPL's body")
    if any(not 0 <= parent < joint for joint, parent in enumerate(parents[1:], start=1)):
        raise BodyFileError(f"{path}: kintree_table has a joint before its parent")
    return parents


def _body_weights(weights: Array, parents: list[int]) -> Array:
    """(V, 22): every further joint's weight goes to its nearest ancestor in the body, rows to sum 1."""
    kept = weights.copy()
    for joint in range(len(parents) - 1, JOINTS - 1, -1):
        kept[:, parents[joint]] += kept[:, joint]
    body = kept[:, :JOINTS]
    return body / body.sum(axis=1, keepdims=True)


def _array(path: Path, arrays: Mapping[str, Any], name: str, shape: tuple[int | None, ...]) -> Array:
    if name not in arrays:
        raise BodyFileError(f"{path}: the field {name} is missing (a body model has {', '.join(FIELDS)})")
    try:
        array = np.asarray(_dense(arrays[name]), dtype=np.float64)
    except Exception as error:
        # What a stranger's pickle puts into a sparse matrix can raise nearly anything.
        told = f"{type(error).__name__}: {error!s:.500}"
        raise BodyFileError(f"{path}: the field {name} is not an array of numbers: {told}") from error
    if array.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, array.shape, strict=True)):
        expected = "(" + ", ".join("*" if want is None else str(want) for want in shape) + ")"
        raise BodyFileError(f"{path}: the field {name} has shape {array.shape}, not {expected}")
    if not array.size and name != "shapedirs":
        raise BodyFileError(f"{path}: the field {name} is empty")
    # NaN compares false. Whatever is larger would not be finite as float32 once it is summed up.
    if name != "kintree_table" and not (np.abs(array) <= LARGEST_VALUE).all():
        raise BodyFileError(f"{path}: the field {name} has values that are not finite, or beyond {LARGEST_VALUE:g}")
    return array


def _tensor(array: Array) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(array, dtype=np.float32))


def _read(path: Path) -> Mapping[str, Any]:
    if not is_file(path):
        raise BodyFileError(f"body.path: there is no file {path}")
    try:
        if path.suffix == ".npz":
            return read_npz(path, FIELDS)
        with path.open("rb") as file:
            content = _ModelUnpickler(file).load()
    except RefusedPickle as error:
        raise BodyFileError(f"{path}: {error}") from error
    except Exception as error:
        # A damaged pickle can raise nearly anything.
        raise BodyFileError(f"{path}: not a readable body model: {type(error).__name__}: {error}") from error
    if not isinstance(content, dict):
        raise BodyFileError(f"{path}: holds a {type(content).__name__}, not a dictionary of arrays")
    return content


class _Chumpy(Inert):
    """chumpy.ch.Ch: an array in `x`."""


class _ChumpySelection(Inert):
    """chumpy.reordering.Select: entries `idxs` of the array `a`."""


class _SparseColumns(Inert):
    """scipy's compressed sparse columns."""


class _SparseRows(Inert):
    """scipy's compressed sparse rows."""


def _dense(value: Any) -> Any:
    if isinstance(value, _Chumpy):
        return value.state["x"]
    if isinstance(value, _ChumpySelection):
        chosen = np.asarray(_dense(value.state["a"])).ravel()[value.state["idxs"]]
        shape = value.state.get("preferred_shape")
        return chosen if shape is None else chosen.reshape(shape)
    if isinstance(value, (_SparseColumns, _SparseRows)):
        state = value.state
        shape = state["_shape"] if "_shape" in state else state["shape"]
        pointers = np.asarray(state["indptr"])
        minor, counts = np.asarray(state["indices"]), np.diff(pointers)
        if math.prod(shape) > MOST_DENSE:
            raise ValueError(f"{shape} is too large")
        if counts.min() < 0 or counts.sum() != len(minor):
            raise ValueError(f"{len(minor)} entries in columns of {counts.sum()}")
        major = np.repeat(np.arange(len(counts)), counts)
        dense = np.zeros(shape)
        np.add.at(dense, (minor, major) if isinstance(value, _SparseColumns) else (major, minor), state["data"])
        return dense
    return value


_SPARSE: dict[str, type[Inert]] = {
    "csc_matrix": _SparseColumns,
    "csc_array": _SparseColumns,
    "csr_matrix": _SparseRows,
    "csr_array": _SparseRows,
}


class _ModelUnpickler(PlainUnpickler):
    """Sparse matrices and chumpy arrays become inert stand-ins."""

    def stand_in(self, module: str, name: str) -> type[Inert] | None:
        if module.startswith("scipy.sparse"):
            return _SPARSE.get(name)
        return {("chumpy.ch", "Ch"): _Chumpy, ("chumpy.reordering", "Select"): _ChumpySelection}.get((module, name))
