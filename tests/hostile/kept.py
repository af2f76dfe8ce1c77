"""Readers of what motiongen keeps for later: judgements, recognizers, stores of clips."""

from __future__ import annotations

import hashlib
import json
import math
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import torch

from motiongen.data.store import ClipStore
from motiongen.evaluation.archive import FIELDS, Archive, Entry
from motiongen.evaluation.figures import clip_values
from motiongen.evaluation.judgement import Judgement
from motiongen.evaluation.metrics.frechet import frechet_distance
from motiongen.recognition.cache import INFO, WEIGHTS, load_recognizer
from motiongen.recognition.recognizer import TrainedRecognizer
from motiongen.recognition.transformer import TransformerRecognizer
from tests.compositions import skeleton
from tests.data.corpus import ListedSource, session
from tests.hostile import reader
from tests.hostile.motions import is_motion
from tests.hostile.reader import JSON, NPZ, Form, Reader

CLIPS, TAGS, FEATURES = 5, 3, 4
ENTRY = Entry(("weights and settings", 0), torch.eye(TAGS).double()[[0, 1, 2, 0, 1]], FEATURES)
SESSIONS = (
    session("one", [(0, 7, "walk"), (7, 12, "wave,stand")], 12),
    session("two", [(1, 4, "stand@sad")], 5, group="pair"),
)
NETWORK = {"width": 8, "heads": 2, "layers": 1, "feedforward": 8, "feature_width": FEATURES, "dropout": 0.0}


@cache
def judgement() -> Judgement:
    draw = torch.Generator().manual_seed(0)
    shapes = {"logits": (CLIPS, TAGS), "features": (CLIPS, FEATURES)}
    fields = {name: torch.rand(shapes.get(name, (CLIPS,)), generator=draw, dtype=torch.float64) for name in FIELDS}
    fields |= {"tags": ENTRY.tags, "joint_position_error": torch.full((CLIPS,), math.nan, dtype=torch.float64)}
    return Judgement(**fields)


@cache
def kept_as() -> str:
    """The name of the file of the judgement."""
    with TemporaryDirectory() as folder:
        Archive(Path(folder)).save(ENTRY, judgement())
        return next(Path(folder).iterdir()).name


def arrays() -> dict[str, Any]:
    return {name: getattr(judgement(), name).numpy() for name in FIELDS}


def is_judged(found: Judgement | None) -> bool:
    """Figures can be computed of it; what is damaged is not there."""
    if found is None:
        return True
    distance = frechet_distance(found.features, judgement().features)
    return not math.isnan(distance) and all(len(values) == CLIPS for values in clip_values(found).values())


@cache
def network() -> TransformerRecognizer:
    with torch.random.fork_rng():
        torch.manual_seed(0)
        return TransformerRecognizer(tags=len(TAG_NAMES), skeleton=skeleton(), **NETWORK)


TAG_NAMES = ("stand", "walk", "wave")
INFORMATION = {"test_accuracy": 0.5, "data_fingerprint": "d" * 64, "tags": list(TAG_NAMES)}


def write_recognizer(folder: Path) -> None:
    (folder / WEIGHTS).write_bytes(reader.as_weights(dict(network().state_dict())))
    (folder / INFO).write_text(json.dumps(INFORMATION))


def recognizer(path: Path) -> TrainedRecognizer:
    return load_recognizer(path.parent, partial(TransformerRecognizer, **NETWORK), TAG_NAMES, skeleton(), "f" * 64)


def recognizes(found: TrainedRecognizer) -> bool:
    with torch.no_grad():
        seen = found.recognizer(SESSIONS[0].features[None], torch.ones(1, len(SESSIONS[0].features), dtype=torch.bool))
    return seen.logits.shape == (1, len(TAG_NAMES)) and 0 <= found.test_accuracy <= 1


@cache
def store_files() -> dict[str, bytes]:
    with TemporaryDirectory() as folder:
        store = ClipStore.open(ListedSource(SESSIONS, frozenset({"walk"})), folder)
        return {path.name: path.read_bytes() for path in store.folder.iterdir()}


def write_store(folder: Path) -> None:
    for name, content in store_files().items():
        (folder / name).write_bytes(content)


def index() -> Any:
    """Without its checksum."""
    content = json.loads(store_files()["index.json"])
    del content["checksum"]
    return content


def signed(content: Any) -> bytes:
    """An index with its checksum, which a stranger can compute."""
    read_back = json.loads(json.dumps(content))
    if not isinstance(read_back, dict):
        return JSON.write(content)
    text = json.dumps(read_back, sort_keys=True)
    return JSON.write(read_back | {"checksum": hashlib.sha256(text.encode()).hexdigest()})


def store(path: Path) -> ClipStore:
    return ClipStore(path.parent)


def is_whole(found: ClipStore) -> bool:
    """All that is asked of a store can be answered."""
    lengths = [len(found.features(number)) for number in range(len(found.sequences))]
    return (
        lengths == [sequence.length for sequence in found.sequences]
        and all(is_motion(found.features(number)) for number in range(len(lengths)))
        and all(isinstance(tag, str) for tag in (*found.tags, *found.styles, *found.root_tags))
        and bool(found.skeleton.offsets.isfinite().all())
    )


READERS = {
    "judgement": Reader(kept_as(), arrays, lambda path: Archive(path.parent).load(ENTRY), is_judged, NPZ),
    "recognizer, weights": Reader(
        WEIGHTS,
        lambda: dict(network().state_dict()),
        recognizer,
        recognizes,
        reader.WEIGHTS,
        write_recognizer,
    ),
    "recognizer, information": Reader(INFO, lambda: INFORMATION, recognizer, recognizes, JSON, write_recognizer),
    "store, index": Reader("index.json", index, store, is_whole, Form(signed), write_store, also=("features.npy",)),
    "store, index with its checksum": Reader(
        "index.json", lambda: store_files()["index.json"], store, is_whole, around=write_store
    ),
    "store, frames": Reader("features.npy", lambda: store_files()["features.npy"], store, is_whole, around=write_store),
}
