"""What decides about the result of a row: its configuration, the data and the code."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from motiongen.discovery import module_path
from motiongen.documents import DocumentError, read_json
from motiongen.runs import GENERATOR_FILE, require_generator, run_folder_of

CHANGES_NOTHING = {
    *("hydra", "cache", "tracker", "study", "reuse", "retry_failed", "search", "trust"),
    *("run", "motions", "runs", "results", "resume", "timeline", "variants", "floor", "smooth", "rank", "formats"),
}
"""Keys at the top of the configuration that are folders, or that no training and no evaluation reads."""
PLACES = {"root", "cache"}
"""Keys of the data that say where it lies; what it is, its own fingerprint says."""
DECIDING_CODE = (
    *("motiongen.contracts", "motiongen.data", "motiongen.evaluation", "motiongen.generation", "motiongen.motion"),
    *("motiongen.objectives", "motiongen.recognition", "motiongen_plugins"),
)
"""Packages and modules whose change can change a result; viewers, exporters and trackers cannot."""
LONG_MOTION_CODE = ("motiongen.synthesis", "motiongen.tasks.long_motion")
"""What decides, besides, about results of long motion."""


@dataclass(frozen=True)
class Identity:
    """Hex digests. Two runs with the same identity have the same result on the same machine."""

    configuration: str
    data: str
    code: str

    def to_json(self) -> dict[str, str]:
        return asdict(self)

    def differences(self, other: Mapping[str, Any]) -> list[str]:
        """The fields in which what was stored is not the same."""
        return [field for field, digest in self.to_json().items() if other.get(field) != digest]


def identity_of(config: DictConfig) -> Identity:
    """The identity of the run of a configuration. Reads the data's files and those of the generators that it judges.

    Raises:
        RunError: there is no such generator.
    """
    configuration = configuration_digest(config)
    if config.runs:
        judged = [_generator_digest(named) for named in config.runs]
        configuration = hashlib.sha256("".join([configuration, *judged]).encode()).hexdigest()
    code = code_digest(LONG_MOTION_CODE if config.task.name == "long_motion" else ())
    return Identity(configuration, instantiate(config.data.source).fingerprint(), code)


def _generator_digest(named: str) -> str:
    folder = run_folder_of(named)
    require_generator(folder, "runs")
    return hashlib.sha256((folder / GENERATOR_FILE).read_bytes()).hexdigest()


def configuration_digest(config: Any) -> str:
    """Of all values that a result depends on, with interpolations resolved."""
    plain = {
        str(key): OmegaConf.to_container(config[key], resolve=True) if OmegaConf.is_config(config[key]) else config[key]
        for key in config
        if str(key) not in CHANGES_NOTHING
    }
    return hashlib.sha256(json.dumps(_without_places(plain), sort_keys=True, default=str).encode()).hexdigest()


def _without_places(node: Any) -> Any:
    if isinstance(node, dict):
        return {key: _without_places(value) for key, value in node.items() if key not in PLACES}
    return [_without_places(value) for value in node] if isinstance(node, list) else node


def code_digest(further: Sequence[str] = ()) -> str:
    """Of the source files in DECIDING_CODE and in further packages and modules, and of torch's version."""
    digest = hashlib.sha256(version("torch").encode())
    for name in (*DECIDING_CODE, *further):
        place = module_path(name)
        if place is None:
            raise ModuleNotFoundError(name)
        for path in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(f"\0{name}/{path.name}\0".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


def read_identity(path: Path) -> dict[str, Any]:
    """What was stored; empty where nothing whole was."""
    try:
        content = read_json(path)
    except DocumentError:
        return {}
    return content if isinstance(content, dict) else {}
