"""AMASS (Mahmood et al. 2019): SMPL-H or SMPL-X parameters in NPZ files. It has no labels; BABEL's are in `babel`."""

from __future__ import annotations

import math
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import roma
import torch
from torch import Tensor

from motiongen.data.roots import DataError
from motiongen.data.sources.arrays import per_frame, read_arrays
from motiongen.data.sources.files import required
from motiongen.data.sources.retarget import at_thirty, features
from motiongen.export.amass import NEUTRAL
from motiongen.motion.bodies import makehuman, smpl
from motiongen.motion.skeleton import JOINTS, Skeleton

FIELDS = (
    *("poses", "root_orient", "pose_body", "trans", "betas", "gender"),
    *("mocap_framerate", "mocap_frame_rate", "surface_model_type"),
)
RATES = {"BMLhandball": 240.0, "20160930_50032": 59.0, "20161014_50033": 59.0}
"""Folders whose files name another frame rate than they were recorded at, and the right one."""
REST_PELVIS = {"smplh": NEUTRAL.rest_pelvis, "smplx": (0.003, -0.351, 0.012)}
"""J0 of the neutral mean bodies, metres; that of other genders and shapes is within a few centimetres."""
MOST_BETAS = 1000
LEG_LENGTH = 0.78
"""Of SMPL's neutral mean body, metres."""


@dataclass(frozen=True)
class Person:
    """What the parameters of a file do not say about whom they move."""

    rest_pelvis: Tensor
    """(3,) metres: the pelvis of the rest pose, about which SMPL turns a body before it adds `trans`"""
    leg_length: float
    """metres"""


class People:
    """The bodies behind AMASS's parameters.

    Args:
        folder: SMPL's own model files, as `smplh/<gender>/model.npz` and `smplx/SMPLX_<GENDER>.npz`, from which each
            person's bones are computed. Without it everyone is taken for SMPL's neutral mean body and shown on the
            built-in figure: rotations are exact, but pelvis heights are off by as much as legs differ from the mean.

    Raises:
        DataError: there is no such folder.
    """

    def __init__(self, folder: str | None) -> None:
        if folder is not None and not Path(folder).expanduser().is_dir():
            raise DataError(f"data.source.bodies: folder {folder} does not exist")
        self._folder = None if folder is None else Path(folder).expanduser()
        self._known: dict[tuple[str, str, tuple[float, ...]], Person] = {}
        self.skeleton: Skeleton = self._mean()

    def person(self, model: str, gender: str, betas: tuple[float, ...]) -> Person:
        """Whom the shape coefficients of an SMPL-H or SMPL-X model describe.

        Raises:
            BodyFileError: the model file is missing or damaged.
        """
        if self._folder is None:
            return Person(torch.tensor(REST_PELVIS[model], dtype=torch.float64), LEG_LENGTH)
        key = model, gender, betas
        if key not in self._known:
            body = smpl(self._file(self._folder, model, gender), betas)
            assert body.model is not None
            rest = torch.tensor(body.model.rest_pelvis, dtype=torch.float64)
            self._known[key] = Person(rest, body.skeleton.leg_length)
        return self._known[key]

    def _mean(self) -> Skeleton:
        if self._folder is None:
            return makehuman().skeleton
        files = [self._file(self._folder, model, "neutral") for model in REST_PELVIS]
        return smpl(next((file for file in files if file.is_file()), files[0])).skeleton

    @staticmethod
    def _file(folder: Path, model: str, gender: str) -> Path:
        name = f"{gender}/model.npz" if model == "smplh" else f"SMPLX_{gender.upper()}.npz"
        return folder / model / name


def read_amass(path: Path, people: People) -> Tensor:
    """The motion of one file as features (T, 135) at 30 Hz, z up.

    Positions are scaled from each person's leg length to that of `people.skeleton`, so that feet meet the same floor.

    Raises:
        DataError: the file is missing or damaged, or lacks a field; the message names both.
        BodyFileError: as `People.person`.
    """
    content = read_arrays(path, FIELDS)
    if "root_orient" in content:
        parts = per_frame(path, content, "root_orient", 3), per_frame(path, content, "pose_body", 3 * (JOINTS - 1))
        if len(parts[0]) != len(parts[1]):
            raise DataError(f"{path}: 'root_orient' has {len(parts[0])} frames and 'pose_body' {len(parts[1])}")
        turns = torch.cat(parts, dim=1)
    else:
        turns = per_frame(path, content, "poses", 3 * JOINTS)
    trans = per_frame(path, content, "trans", 3)
    if len(turns) != len(trans):
        raise DataError(f"{path}: {len(turns)} frames of poses and {len(trans)} of 'trans'")
    model = _word(path, content, "surface_model_type", "smplx" if "root_orient" in content else "smplh")
    gender = _word(path, content, "gender", "neutral")
    if model not in REST_PELVIS or gender not in ("neutral", "female", "male"):
        raise DataError(f"{path}: a {gender:.40} {model:.40} body is none that AMASS has")
    betas = content.get("betas", np.zeros(0))
    if betas.dtype.kind not in "fiu" or betas.ndim > 2 or betas.size > MOST_BETAS or not np.isfinite(betas).all():
        raise DataError(f"{path}: field 'betas' is not of finite numbers, at most {MOST_BETAS}")
    person = people.person(model, gender, tuple(map(float, betas.ravel())))
    pelvis = (trans + person.rest_pelvis) * (people.skeleton.leg_length / person.leg_length)
    local = roma.rotvec_to_rotmat(turns.reshape(-1, JOINTS, 3))
    return features(*at_thirty(path, local, pelvis, _rate(path, content)))


def checksums(path: Path) -> list[tuple[str, int, int]]:
    """Name, size and CRC-32 of each array in an NPZ file, which its directory says without reading them.

    Of a file without such a directory, which is damaged, those of the whole.

    Raises:
        DataError: the file is missing or cannot be read.
    """
    try:
        with zipfile.ZipFile(required(path)) as file:
            return [(member.filename, member.file_size, member.CRC) for member in file.infolist()]
    except DataError:
        raise
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror}") from error
    except Exception:
        # A damaged directory can make zipfile raise nearly anything.
        content = path.read_bytes()
        return [(path.name, len(content), zlib.crc32(content))]


def _rate(path: Path, content: dict[str, Any]) -> float:
    for folder, rate in RATES.items():
        if folder in path.parts:
            return rate
    given = content.get("mocap_framerate", content.get("mocap_frame_rate"))
    if given is None:
        raise DataError(f"{path}: field 'mocap_framerate' is missing")
    rate = float(given.item()) if given.size == 1 and given.dtype.kind in "fiu" else math.nan
    if not 0 < rate < math.inf:
        raise DataError(f"{path}: field 'mocap_framerate': {given!s:.100} is not a frame rate")
    return rate


def _word(path: Path, content: dict[str, Any], field: str, otherwise: str) -> str:
    """A field of one word, which some files store as bytes."""
    array = np.asarray(content.get(field, otherwise))
    if array.dtype.kind not in "SU" or array.ndim > 1:
        raise DataError(f"{path}: field {field!r} is not a word")
    if not array.size:
        return otherwise
    value = array.ravel()[0]
    return value.decode("latin1") if isinstance(value, bytes) else str(value)
