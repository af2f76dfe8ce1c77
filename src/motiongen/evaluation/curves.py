"""Figures along the places of a sequence, as a picture (Neural Marionette, Fig. 8 and 10)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from motiongen.evaluation.long_results import COLUMNS, LongResult
from motiongen.evaluation.results import REAL
from motiongen.files import replacing

HEADINGS = {name: heading for name, (heading, _) in COLUMNS.items()} | {"action_qr": "action QR"}
COLUMN_COUNT = 3


def draw_curves(path: Path, results: Mapping[str, LongResult]) -> None:
    """Write a PNG with one small diagram for every figure, one line a system; real clips are dashed."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    names = [name for name in HEADINGS if name in next(iter(results.values())).curves]
    rows = -(-len(names) // COLUMN_COUNT)
    figure = Figure(figsize=(4.4 * COLUMN_COUNT, 2.8 * rows), layout="constrained")
    for place, name in enumerate(names, start=1):
        axes = figure.add_subplot(rows, COLUMN_COUNT, place)
        for system, result in results.items():
            curve = result.curves[name]
            dashes = "--" if system == REAL else "-"
            axes.plot(range(1, len(curve) + 1), curve, dashes, label=system, linewidth=1.4)
        axes.set_title(HEADINGS[name], fontsize=10)
        axes.set_xlabel("place in the sequence", fontsize=8)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.grid(alpha=0.3)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=8)
    with replacing(path) as partial:
        figure.savefig(partial, dpi=110)
