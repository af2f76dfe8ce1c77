"""What was measured already, on disk: an evaluation that was interrupted, or gets more seeds, repeats nothing."""

from __future__ import annotations

import inspect
import json
import zipfile
from dataclasses import fields
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import torch

import motiongen
from motiongen.contracts import GeneratorModule
from motiongen.evaluation.judgement import Judgement
from motiongen.files import replacing


class Archive:
    """Judgements by what they are of. A key is everything that they depend on; another key is another file.

    Args:
        folder: is made when something is kept.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def load(self, key: tuple[Any, ...]) -> Judgement | None:
        """What was kept under the key, or None; a file that cannot be read counts as absent and is made anew."""
        path = self._path(key)
        try:
            with np.load(path, allow_pickle=False) as arrays:
                return Judgement(**{field.name: torch.from_numpy(arrays[field.name]) for field in fields(Judgement)})
        except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
            return None

    def save(self, key: tuple[Any, ...], judgement: Judgement) -> None:
        """Keep it; the file is whole or absent."""
        path = self._path(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as partial:
            np.savez(partial, **{field.name: getattr(judgement, field.name).numpy() for field in fields(judgement)})

    def _path(self, key: tuple[Any, ...]) -> Path:
        return self._folder / f"{sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()}.npz"


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
