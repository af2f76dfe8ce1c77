"""`task=prepare`: read a data set once, so that later runs start at once."""

from __future__ import annotations

from omegaconf import DictConfig

from motiongen.data.datamodule import MotionData
from motiongen.data.statistics import FPS, Statistics, statistics_of
from motiongen.evaluation.table import markdown
from motiongen.tasks.assembly import build_body, build_data, run_folder
from motiongen.tasks.data_pictures import draw_clips, draw_transitions
from motiongen.tasks.receipts import Receipt
from motiongen.tasks.record import Record


def run(config: DictConfig, receipt: Receipt) -> None:
    """Parse the data unless the cache holds it, and say what is in it; pictures and a record are made of new data."""
    data = build_data(config)
    statistics = statistics_of(data)
    lines = report(data, statistics)
    again = [*lines, f"It was prepared before: {data.store.folder}"]
    receipt.keep(data.store.folder, again)
    if not data.store.was_made:
        print("\n".join(again))
        return
    folder = run_folder()
    with Record(config, folder) as record:
        record.data(data)
        pictures = [draw_clips(folder / "clips.png", data, build_body(config, data))]
        if statistics.transitions.any():
            pictures.append(draw_transitions(folder / "transitions.png", statistics))
        record.preparation(lines, pictures)
    record.print_outcome()


def report(data: MotionData, statistics: Statistics) -> list[str]:
    """Counts, and what was dropped and why, as lines of Markdown."""
    lines = [
        markdown(statistics.rows()),
        "",
        f"{data.name}: {statistics.sequences} sequences, {len(statistics.clips)} clips, {statistics.frames} frames, "
        f"{statistics.frames / FPS / 3600:.2f} hours, fingerprint {data.fingerprint[:12]}",
        f"Split: {len(data.split.train)} clips to train, {len(data.split.test)} to test",
    ]
    if dropped := len(statistics.clips) - statistics.used:
        lines.append(f"Dropped: {dropped} clips that are too short or have no tag that is on both sides")
    lines += [f"Left out: {tag} ({reason})" for tag, reason in data.split.left_out.items()]
    quarantine = list(data.store.quarantine.items())
    if quarantine:
        lines.append(f"Quarantine: {len(quarantine)} damaged parts")
    lines += [f"- {name}: {reason}" for name, reason in quarantine]
    return lines
