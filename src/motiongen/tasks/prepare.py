"""`task=prepare`: read a data set once, so that later runs start at once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from omegaconf import DictConfig

from motiongen.data.datamodule import MotionData
from motiongen.data.splits import Clip
from motiongen.evaluation.table import markdown
from motiongen.tasks.assembly import build_data


def run(config: DictConfig) -> None:
    """Parse the data unless the cache holds it, and print what is in it."""
    data = build_data(config)
    train, test = _count(data, data.split.train), _count(data, data.split.test)
    rows = [{"tag": tag, "training clips": str(train[tag]), "test clips": str(test[tag])} for tag in data.tags]
    print(markdown(rows))
    for tag, reason in data.split.left_out.items():
        print(f"left out: {tag} ({reason})")
    frames = sum(sequence.length for sequence in data.store.sequences)
    print(f"{data.name}: {len(data.store.sequences)} sequences, {frames} frames, fingerprint {data.fingerprint[:12]}")


def _count(data: MotionData, clips: Iterable[Clip]) -> Counter[str]:
    return Counter(tag for clip in clips for tag in data.store.sequences[clip.sequence].segments[clip.segment].tags)
