"""What was measured already, on disk: an evaluation that was interrupted, or gets more seeds, repeats nothing."""

from __future__ import annotations

import inspect
import json
import logging
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import motiongen
from motiongen.arrays import read_npz
from motiongen.contracts import GeneratorModule
from motiongen.evaluation.judgement import Judgement
from motiongen.files import is_file, replacing

FIELDS = tuple(field.name for field in fields(Judgement))

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Entry:
    """What a judgement is kept under, and the form that it has to have."""

    key: tuple[Any, ...]
    """Everything that it depends on, as plain values"""
    tags: Tensor
    """(N, A) float64: what the clips are asked to show"""
    width: int
    """E, of the features"""

    def of(self, *parts: Any) -> Entry:
        """The entry of a part, such as one seed."""
        return replace(self, key=(*self.key, *parts))


class Archive:
    """Judgements by what they are of; what depends on anything else is in another file.

    Args:
        folder: is made when something is kept.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def load(self, entry: Entry) -> Judgement | None:
        """What was kept, or None; a file that is no such judgement counts as absent and is made anew."""
        path = self._path(entry)
        if not is_file(path):
            return None
        try:
            arrays = read_npz(path, FIELDS)
            _check(arrays, entry)
        except ValueError as error:
            _log.warning("%s is damaged (%s) and is made anew", path, error)
            return None
        return Judgement(**{name: torch.from_numpy(array) for name, array in arrays.items()})

    def save(self, entry: Entry, judgement: Judgement) -> None:
        """Keep it; the file is whole or absent."""
        path = self._path(entry)
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as partial:
            np.savez(partial, **{name: getattr(judgement, name).numpy() for name in FIELDS})

    def _path(self, entry: Entry) -> Path:
        return self._folder / f"{sha256(json.dumps(entry.key, sort_keys=True).encode()).hexdigest()}.npz"


def _check(arrays: Mapping[str, NDArray[Any]], entry: Entry) -> None:
    """Raises ValueError unless these are the fields of a judgement of such clips."""
    tags = entry.tags.numpy()
    shapes = {"tags": tags.shape, "logits": tags.shape, "features": (len(tags), entry.width)}
    for name in FIELDS:
        if name not in arrays:
            raise ValueError(f"field {name!r} is missing")
        array, shape = arrays[name], shapes.get(name, (len(tags),))
        if array.dtype != np.float64 or array.shape != shape:
            raise ValueError(f"field {name!r} is {array.dtype} of {array.shape}, not float64 of {shape}")
        # What was not measured is NaN, but a recognizer always answers, in single precision.
        if name in shapes and not (np.abs(array) <= np.finfo(np.float32).max).all():
            raise ValueError(f"field {name!r} is not finite")
    if not np.array_equal(arrays["tags"], tags):
        raise ValueError("field 'tags' is that of other clips")


def generator_fingerprint(generator: GeneratorModule, settings: Any) -> str:
    """Hex digest of everything that decides what a generator makes: weights, settings, and the code that runs.

    Args:
        generator: its weights, and the source files of its modules, plugins of other packages among them.
        settings: its configuration, as plain values.
    """
    digest = sha256(json.dumps([torch.__version__, settings], sort_keys=True).encode())
    core = sorted(Path(motiongen.__file__).parent.rglob("*.py"))
    parts = {Path(inspect.getfile(type(module))) for module in generator.modules()}
    for path in [*core, *sorted(parts)]:
        digest.update(path.read_bytes())
    for name, value in sorted(generator.state_dict().items()):
        digest.update(name.encode())
        digest.update(value.detach().cpu().contiguous().reshape(-1).view(torch.uint8).numpy().tobytes())
    return digest.hexdigest()
