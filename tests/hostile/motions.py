"""Readers of motions, bodies, timelines and trained generators."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch

from motiongen.data.sources.amass import People, checksums, read_amass
from motiongen.data.sources.amc import read_amc
from motiongen.data.sources.bvh import Bvh, read_bvh
from motiongen.data.sources.bvh_names import CONVENTIONS
from motiongen.data.sources.bvh_rig import read_mapping
from motiongen.data.sources.files import read_json
from motiongen.data.sources.folder import read_labels, read_motion
from motiongen.generation.checkpoint import load_generator, save_generator
from motiongen.generation.fitting import require_resumable
from motiongen.generation.lightning import TrainingShell
from motiongen.motion.bodies import Body, smpl
from motiongen.motion.representation import FEATURES
from motiongen.motion.skeleton import JOINT_NAMES
from motiongen.synthesis.timeline import Timeline, read_timeline
from tests.compositions import marionet, skeleton
from tests.data.sources.miniatures import Known, amass
from tests.data.sources.rigs import RigFile, body, motion
from tests.hostile.reader import JSON, NPZ, PICKLE, WEIGHTS, YAML, Reader, as_file
from tests.motion.bodies.test_smpl import model

TAGS = ("bow", "kick", "run", "walk", "wave")
SPANS = [("store", "take", 0, 9)]
TIMELINE = {
    "actions": [{"tags": ["walk", "wave"], "seconds": 2, "path": [[0, 0], [1, 2.5]]}, {"tags": "sit", "seconds": 1.5}],
    "style": "sad",
    "seed": 3,
    "variants": 2,
}
SMALL = {name: array.astype(np.float32) if array.dtype.kind == "f" else array for name, array in model(24).items()}
MAPPING = {
    "up": "y",
    "metres": 0.01,
    "joints": dict(CONVENTIONS["smpl"]),
    "align": {joint: np.eye(3).tolist() for joint in JOINT_NAMES},
}
AMC = b"# made up\n:FULLY-SPECIFIED\n:DEGREES\n" + b"".join(
    b"%d\nroot 1 2 3 4.5 -6 7\narm 1.25 2 -3\nleg 5\n" % number for number in range(1, 6)
)
LABELS = b"file,tags\nlabels.csv,walk + wave\n./labels.csv,sit\n"
POSES = {"poses": np.ones((5, 66)), "trans": np.ones((5, 3)), "mocap_framerate": np.array(60.0)}


def bvh(frames: int = 8) -> bytes:
    return as_file(lambda path: RigFile(CONVENTIONS["smpl"], unit=0.01).write(path, *motion(frames), body()), "a.bvh")()


@cache
def shell() -> TrainingShell:
    """Trains a small generator; nothing but its weights is looked at."""
    return TrainingShell(marionet(), None, skeleton(), None, 0)


def saved(path: Path) -> Any:
    save_generator(path, shell().generator, TAGS, SPANS)


@cache
def checkpoint() -> Any:
    state = shell().generator.state_dict()
    sizes = {"features": FEATURES, "tags": 5, "initial_frames": 6, "width": 32, "styles": 0}
    return {"format": 1, "tags": list(TAGS), "dimensions": sizes, "trained_on": SPANS, "state": dict(state)}


@cache
def to_go_on_from() -> Any:
    state = dict(shell().state_dict())
    return {"epoch": 1, "global_step": 8, "state_dict": state, "optimizer_states": [{"state": {}}], "loops": {}}


def is_motion(features: torch.Tensor) -> bool:
    return features.shape[1] == FEATURES and len(features) > 0 and bool(features.isfinite().all())


def is_bvh(found: Bvh) -> bool:
    tensors = (found.offsets, found.rotations, found.positions, *found.world())
    return len(set(found.names)) == len(found.names) and all(bool(one.isfinite().all()) for one in tensors)


def is_body(found: Body) -> bool:
    return all(bool(one.isfinite().all()) for one in (found.rest, found.weights, found.skeleton.offsets))


def is_timeline(found: Timeline) -> bool:
    return all(action.frames > 0 and action.tags and action.label for action in found.actions)


def are_labels(found: dict[str, tuple[str, ...]]) -> bool:
    return all(all(tags) for tags in found.values())


def are_tables(found: dict[str, torch.Tensor]) -> bool:
    return all(bool(values.isfinite().all()) for values in found.values())


def is_loaded(found: tuple[Any, ...]) -> bool:
    return all(isinstance(span, tuple) for span in found)


def is_mapping(found: Any) -> bool:
    return len(found) == 4 and (found[3] is None or bool(found[3].isfinite().all()))


def amc(path: Path) -> Any:
    return read_amc(path, {"root": 6, "arm": 3, "leg": 1})


def timeline(path: Path) -> Timeline:
    return read_timeline(str(path))


def generator(path: Path) -> Any:
    return load_generator(path, shell().generator, TAGS)


@cache
def people() -> People:
    return People(None)


def features_of_amass(path: Path) -> torch.Tensor:
    return read_amass(path, people())


def parameters(layout: str) -> dict[str, Any]:
    return amass(Known(3), 6, 60.0, np.zeros(3), layout)


READERS = {
    "bvh": Reader("a.bvh", bvh, read_bvh, is_bvh),
    "motion as bvh": Reader("a.bvh", bvh, read_motion, is_motion),
    "amc": Reader("a.amc", lambda: AMC, amc, are_tables),
    "poses": Reader("a.npz", lambda: POSES, read_motion, is_motion, NPZ),
    "features": Reader("a.npz", lambda: {"features": np.ones((5, FEATURES)), "fps": 30.0}, read_motion, is_motion, NPZ),
    "amass, smpl-h": Reader("a.npz", lambda: parameters("smplh"), features_of_amass, is_motion, NPZ),
    "amass, smpl-x": Reader("a.npz", lambda: parameters("smplx"), features_of_amass, is_motion, NPZ),
    "amass, checksums": Reader("a.npz", lambda: parameters("smplh"), checksums, lambda found: found is not None, NPZ),
    "body as npz": Reader("a.npz", lambda: SMALL, smpl, is_body, NPZ),
    "body as pickle": Reader("a.pkl", lambda: SMALL, smpl, is_body, PICKLE),
    "timeline as yaml": Reader("a.yaml", lambda: TIMELINE, timeline, is_timeline, YAML),
    "timeline as json": Reader("a.json", lambda: TIMELINE, timeline, is_timeline, JSON),
    "labels": Reader(
        "labels.csv", lambda: b"file,tags\nlabels.csv,walk + wave\n./labels.csv,a\n", read_labels, are_labels
    ),
    "mapping": Reader("a.yaml", lambda: MAPPING, read_mapping, is_mapping, YAML),
    "json": Reader("a.json", lambda: TIMELINE, read_json, lambda found: True, JSON),
    "generator": Reader("a.pt", checkpoint, generator, is_loaded, WEIGHTS),
    "generator as it is saved": Reader("a.pt", as_file(saved, "a.pt"), generator, is_loaded),
    "checkpoint to go on from": Reader(
        "last.ckpt",
        to_go_on_from,
        lambda path: require_resumable(path, shell()),
        lambda found: found is None,
        WEIGHTS,
    ),
}
