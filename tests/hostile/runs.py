"""Readers of what runs, studies and searches left behind."""

from __future__ import annotations

import contextlib
import copy
import io
from functools import cache
from pathlib import Path

import numpy as np
import optuna
from omegaconf import OmegaConf
from PIL import Image

from motiongen.evaluation.latents import LATENTS_FILE
from motiongen.evaluation.long_results import COLUMNS
from motiongen.evaluation.stored import StoredResult, alike, read_result, result_rows
from motiongen.evaluation.table import HEADINGS, markdown
from motiongen.foreign import danger_in
from motiongen.runs import RUN_ID, RUN_ID_FILE, completed, known_tags, run_id_in, stored_overrides
from motiongen.search.objectives import measured
from motiongen.search.storage import open_storage
from motiongen.studies.curves import curves_csv, length_curves, place_curves
from motiongen.studies.identity import read_identity
from motiongen.studies.latents import code_rows, read_picture
from motiongen.studies.rendering import as_csv, as_html, as_latex, as_markdown
from motiongen.studies.results import StudyResults, row_result
from motiongen.studies.rows import FAILED_FILE, ROW_FILE, failure
from motiongen.studies.table import study_table
from tests.hostile.reader import JSON, YAML, Reader, as_file

METRICS = {metric: {"mean": 0.5, "interval": None if metric == "fid" else 0.25} for metric in HEADINGS}
SYSTEM = {
    "metrics": METRICS,
    "count": 100,
    "lengths": [{"frames": 60, "same_length": True, "metrics": {"accuracy": {"mean": 0.5}, "fid": {"mean": 2.0}}}],
}
OPINION = {
    "protocol": {"seeds": 5, "first_seed": 0, "lengths": [60]},
    "seeds": [0, 1, 2, 3, 4],
    "count": 100,
    "data_fingerprint": "a" * 64,
    "recognizer": {"name": "TransformerRecognizer", "fingerprint": "b" * 64, "test_accuracy": 0.9},
    "systems": dict.fromkeys(("real", "generated", "untrained"), SYSTEM),
}
SUMMARY = {
    "name": "actor-builtin-smoke-s0",
    "milliseconds_per_frame": 1.5,
    "data": {"fingerprint": "a" * 64, "tags": ["stand", "walk"]},
    "evaluation": OPINION,
    "second_evaluation": {**OPINION, "recognizer": {**OPINION["recognizer"], "name": "STGCNRecognizer"}},
    "latents": {"tag_from_latent": 0.2, "tag_from_modulated": 0.9, "tag_by_commonest": 0.1},
}
LONG_SYSTEM = {
    "figures": {figure: {"value": 0.5, "low": 0.4, "high": 0.6} for figure in COLUMNS},
    "curves": {figure: [0.5, None, 0.25] for figure in COLUMNS},
}
LONG_SUMMARY = {
    "name": "row-s0",
    "data": {"fingerprint": "d" * 64},
    "sequences": {"kinds": ["overall", "sufficient"], "count": 3, "actions": 3},
    "recognizers": [{"name": name, "fingerprint": "f" * 64, "test_accuracy": 0.9} for name in ("Judge", "Other")],
    "overall_long_motion": {"real": LONG_SYSTEM, "marionette-s0, pure": LONG_SYSTEM},
    "sufficient_long_motion": {"real": LONG_SYSTEM, "marionette-s0, pure": LONG_SYSTEM},
    "second_overall_long_motion": {"real": LONG_SYSTEM, "marionette-s0, pure": LONG_SYSTEM},
    "second_sufficient_long_motion": {"real": LONG_SYSTEM, "marionette-s0, pure": LONG_SYSTEM},
}
OVERRIDES = ["+experiment=actor", "seed=1", "scale=smoke", "generator.width=${width:64}", "data.source.sessions=8"]
SETTINGS = {"hydra": {"runtime": {"cwd": "/", "choices": {"scale": "smoke"}}, "job": {"name": "motiongen"}}}
RECORD = {"configuration": "a" * 64, "data": "b" * 64, "code": "c" * 64}
FAILURE = {"reason": "data: no clips\nat all", "trace": "Traceback ..."}
FIGURES = ("fid", "accuracy", "milliseconds_per_frame")


def is_shown(found: StoredResult) -> bool:
    """It can be shown beside another result."""
    other = StoredResult("other", copy.deepcopy(SUMMARY["evaluation"]))
    groups = alike([other, found])
    return all(markdown(result_rows(group)) for group in groups) and isinstance(other.differences(found), list)


def is_row(found: StoredResult) -> bool:
    """A study can be made of it."""
    is_long = "seeds" not in found.evaluation
    metrics = ("overall_fid", "sufficient_accuracy") if is_long else ("fid", "accuracy", "joint_speed", "kid")
    settings = OmegaConf.create({"name": "parts", "metrics": metrics, "published": None})
    results = StudyResults("parts", "id", {"row": (found, found)}, ())
    table = study_table(results, settings, "what parts are worth")
    curves = place_curves(results, metrics) if is_long else length_curves(results)
    codes = code_rows(results)
    texts = (as_markdown(table, codes), as_csv(table), as_latex(table), as_html(table, [], codes))
    return all(text.encode() for text in texts) and (curves is None or bool(curves_csv(curves).encode()))


def is_line(found: str) -> bool:
    return len(found.splitlines()) <= 1 and isinstance(found.encode(), bytes)


def are_overrides(found: list[str]) -> bool:
    return all(isinstance(text, str) and not danger_in(text) for text in found)


def write_run(folder: Path) -> None:
    (folder / ".hydra").mkdir()
    (folder / ".hydra" / "overrides.yaml").write_bytes(YAML.write(OVERRIDES))
    (folder / ".hydra" / "hydra.yaml").write_bytes(YAML.write(SETTINGS))
    for name in ("generator.pt", "last.ckpt"):
        (folder / name).touch()


def resumed(path: Path) -> list[str]:
    """Going on changes into the folder that is named; the test stays where it was."""
    with contextlib.chdir(path.parent):
        return completed([f"resume={path.parents[1]}"])


def picture() -> bytes:
    target = io.BytesIO()
    Image.fromarray(np.arange(60 * 80 * 3, dtype=np.uint8).reshape(60, 80, 3)).save(target, "PNG")
    return target.getvalue()


@cache
def search_journal() -> bytes:
    def write(path: Path) -> None:
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        study = optuna.create_study(storage=open_storage(str(path)), study_name="test")
        for _ in range(2):
            trial = study.ask()
            trial.suggest_float("x", 0, 1)
            trial.suggest_categorical("kind", ["a", "b"])
            trial.set_user_attr("worker", "w")
            study.tell(trial, 0.5)

    return as_file(write, "journal.log")()


READERS = {
    "result": Reader("summary.json", lambda: SUMMARY, lambda path: read_result(path.parent), is_shown, JSON),
    "row of a study": Reader("summary.json", lambda: SUMMARY, lambda path: row_result(path.parent), is_row, JSON),
    "row of long motion": Reader(
        "summary.json", lambda: LONG_SUMMARY, lambda path: row_result(path.parent), is_row, JSON
    ),
    "objectives of a trial": Reader(
        "summary.json",
        lambda: SUMMARY,
        lambda path: measured(path.parent, FIGURES),
        lambda found: found is None or all(abs(value) < np.inf for value in found),
        JSON,
    ),
    "tags of a run": Reader(
        "summary.json",
        lambda: SUMMARY,
        lambda path: known_tags(str(path.parent)),
        lambda found: all(isinstance(tag, str) for tag in found or ()),
        JSON,
    ),
    "overrides": Reader(
        ".hydra/overrides.yaml",
        lambda: OVERRIDES,
        lambda path: stored_overrides(path.parents[1], "run"),
        are_overrides,
        YAML,
        write_run,
    ),
    "where a run was started": Reader(
        ".hydra/hydra.yaml",
        lambda: SETTINGS,
        resumed,
        lambda found: found[-1].startswith("hydra.run.dir="),
        YAML,
        write_run,
    ),
    "id in mlflow": Reader(
        RUN_ID_FILE,
        lambda: b"0123456789abcdef" * 2,
        lambda path: run_id_in(path.parent),
        lambda found: found == "" or RUN_ID.fullmatch(found) is not None,
    ),
    "record of a row": Reader(ROW_FILE, lambda: RECORD, read_identity, lambda found: isinstance(found, dict), JSON),
    "failure of a row": Reader(
        FAILED_FILE,
        lambda: FAILURE,
        lambda path: failure(path.parent),
        is_line,
        JSON,
    ),
    "picture of codes": Reader(LATENTS_FILE, picture, read_picture, lambda found: found.ndim == 3),
    "journal of a search": Reader(
        "journal.log", search_journal, lambda path: open_storage(str(path)), lambda found: found is not None
    ),
}
