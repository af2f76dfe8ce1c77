"""What the codes of a study's rows tell of the action, and their pictures."""

from __future__ import annotations

import tempfile
from pathlib import Path

from motiongen.evaluation.latents import LATENTS_FILE
from motiongen.studies.results import StudyResults
from motiongen.studies.statistics import over_trainings
from motiongen.studies.table import decimals_text

COLUMNS = {"tag_from_latent": "before", "tag_from_modulated": "after", "tag_by_commonest": "commonest"}


def code_rows(results: StudyResults) -> list[dict[str, str]]:
    """One line a row whose generator has codes: its figures over trainings."""
    lines = []
    for row, trainings in results.rows.items():
        having = [one.latents for one in trainings if one.latents]
        if having:
            figures = {text: over_trainings([one[name] for one in having]) for name, text in COLUMNS.items()}
            cells = {text: decimals_text(interval, 3) for text, interval in figures.items()}
            lines.append({"row": row.replace("_", " ")} | cells)
    return lines


def latent_pictures(uri: str, results: StudyResults) -> dict[str, bytes]:
    """Row to the picture of its first training's codes, a PNG from MLflow; rows without codes have none."""
    from mlflow import MlflowClient

    client = MlflowClient(uri)
    pictures = {}
    for row, run_id in results.runs.items():
        if results.rows[row][0].latents:
            with tempfile.TemporaryDirectory() as folder:
                pictures[row] = Path(client.download_artifacts(run_id, LATENTS_FILE, folder)).read_bytes()
    return pictures
