"""A study's figures as a picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motiongen.files import replacing
from motiongen.studies.table import StudyTable

HEIGHT_OF_A_ROW = 0.4
WIDTH_OF_A_METRIC = 3.4
OURS, PAPER, REAL = "#1f5fa8", "#c0562a", "#555555"


def draw_rows(path: Path, table: StudyTable) -> None:
    """One panel a metric, one line a row: our mean with its interval; the paper's figure on a scale of its own."""
    from matplotlib.figure import Figure

    names = list(table.rows)
    size = (1.8 + WIDTH_OF_A_METRIC * len(table.metrics), 1.6 + HEIGHT_OF_A_ROW * len(names))
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(1, len(table.metrics), sharey=True, squeeze=False)[0]
    places = range(len(names))
    for panel, metric in zip(panels, table.metrics, strict=True):
        cells = [table.rows[name][metric] for name in names]
        means = [cell.ours.value for cell in cells]
        halves = [0.0 if math.isnan(cell.ours.high) else cell.ours.high - cell.ours.value for cell in cells]
        panel.errorbar(means, places, xerr=halves, fmt="o", color=OURS, capsize=3, label="here")
        real = table.real[metric]
        if real is not None:
            panel.axvline(real, color=REAL, linestyle=":", label="real")
        panel.set_xlabel(table.heading(metric), color=OURS)
        panel.grid(axis="y", color="#eeeeee")
        theirs = [(cell.published, place) for cell, place in zip(cells, places, strict=True)]
        known = [(value, place) for value, place in theirs if value is not None]
        if known:
            other = panel.twiny()
            other.plot(*zip(*known, strict=True), "D", color=PAPER, fillstyle="none")
            other.set_xlabel(f"{table.heading(metric)}, paper", color=PAPER)
    panels[0].set_yticks(list(places), [name.replace("_", " ") for name in names])
    panels[0].invert_yaxis()
    with replacing(path) as partial:
        figure.savefig(partial, dpi=120)


def lay_side_by_side(path: Path, images: Mapping[str, NDArray[np.uint8]]) -> None:
    """Pictures (H, W, 3) of equal size, one below the other, with the names of their rows above them."""
    from matplotlib.figure import Figure

    height, width = next(iter(images.values())).shape[:2]
    figure = Figure(figsize=(9.0, (9.0 * height / width + 0.3) * len(images)), layout="constrained")
    panels = figure.subplots(len(images), 1, squeeze=False)[:, 0]
    for panel, (name, image) in zip(panels, images.items(), strict=True):
        panel.imshow(image)
        panel.set_title(name.replace("_", " "), fontsize=11, loc="left")
        panel.set_axis_off()
    with replacing(path) as partial:
        figure.savefig(partial, dpi=120)
