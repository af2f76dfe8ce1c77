"""What the codes of a study's rows tell of the action, and their pictures."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import PIL.Image
from numpy.typing import NDArray

from motiongen.evaluation.latents import LATENTS_FILE
from motiongen.studies.naming import StudyError
from motiongen.studies.results import StudyResults
from motiongen.studies.statistics import over_trainings
from motiongen.studies.table import decimals_text

COLUMNS = {"tag_from_latent": "before", "tag_from_modulated": "after", "tag_by_commonest": "commonest"}
SIDES = (50, 5000)
"""Pixels of a picture's sides, at least and at most"""
Image = NDArray[np.uint8]
"""(H, W, 3)"""


def code_rows(results: StudyResults) -> list[dict[str, str]]:
    """One line a row whose generator has codes: its figures over trainings."""
    lines = []
    for row, trainings in results.rows.items():
        having = [one.latents for one in trainings if one.latents and one.latents.keys() >= COLUMNS.keys()]
        if having:
            figures = {text: over_trainings([float(one[name]) for one in having]) for name, text in COLUMNS.items()}
            cells = {text: decimals_text(interval, 3) for text, interval in figures.items()}
            lines.append({"row": row.replace("_", " ")} | cells)
    return lines


def latent_pictures(uri: str, results: StudyResults) -> dict[str, Image]:
    """Row to the picture of its first training's codes, a PNG from MLflow; rows without codes have none.

    Raises:
        StudyError: a picture is damaged.
    """
    from mlflow import MlflowClient

    client = MlflowClient(uri)
    pictures = {}
    for row, run_id in results.runs.items():
        if results.rows[row][0].latents:
            with tempfile.TemporaryDirectory() as folder:
                pictures[row] = read_picture(Path(client.download_artifacts(run_id, LATENTS_FILE, folder)))
    return pictures


def read_picture(path: Path) -> Image:
    """A PNG as `draw_latents` makes it.

    Raises:
        StudyError: not such a picture, or damaged; the message names the file.
    """
    try:
        with PIL.Image.open(path, formats=["PNG"]) as picture:
            if not all(SIDES[0] <= side <= SIDES[1] for side in picture.size):
                raise ValueError(f"{picture.width} x {picture.height} pixels")
            return np.asarray(picture.convert("RGB"))
    except Exception as error:
        # A damaged picture can raise nearly anything.
        raise StudyError(f"report: {path}: not a readable picture: {type(error).__name__}: {error!s:.500}") from error
