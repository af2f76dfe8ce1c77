"""`task=report`: what earlier runs measured, side by side: those in `results=[...]`, or the rows of `study=...`."""

from __future__ import annotations

from pathlib import Path

from omegaconf import DictConfig

from motiongen.discovery import options
from motiongen.evaluation.stored import alike, read_result, result_rows
from motiongen.evaluation.table import markdown
from motiongen.files import replacing
from motiongen.resolvers import changes_in
from motiongen.runs import run_folder_of
from motiongen.studies.naming import changes_text, study_folder


def run(config: DictConfig) -> None:
    """Print the table or tables."""
    if config.study is not None:
        report_study(config)
    else:
        report_runs(config)


def report_runs(config: DictConfig) -> None:
    """A table for every group of results that were measured alike, and what the others differ in."""
    groups = alike(read_result(run_folder_of(named)) for named in config.results)
    for number, group in enumerate(groups):
        if number:
            print(f"\nThese do not compare with those of {groups[0][0].name}:")
            print("\n".join(f"- {text}" for text in groups[0][0].differences(group[0])), end="\n\n")
        print(markdown(result_rows(group)))


def report_study(config: DictConfig) -> None:
    """The study's table as report.md, .csv, .tex and .html in its folder and in its run in MLflow, and its curves.

    Raises:
        StudyError: nothing was measured, or not alike, or the overrides leave open which rows are meant.
    """
    from motiongen.evaluation.latents import LATENTS_FILE
    from motiongen.studies.curves import curves_csv, draw_curves, length_curves, place_curves
    from motiongen.studies.latents import code_rows, latent_pictures
    from motiongen.studies.plots import draw_rows, lay_side_by_side
    from motiongen.studies.rendering import as_csv, as_html, as_latex, as_markdown
    from motiongen.studies.results import study_results
    from motiongen.studies.table import study_table
    from motiongen.tracking.mlflow import MlflowTracker

    choices = config.hydra.runtime.choices
    name = str(config.study.name)
    folder = study_folder(name, choices["data"], choices["scale"])
    changes = changes_text(changes_in(config.hydra.overrides.task))
    results = study_results(config.tracker, name, folder, changes)
    table = study_table(results, config.study, _title(name))
    pictures = [folder / "report.png"]
    draw_rows(pictures[0], table)
    paths = []
    for curves in filter(None, (length_curves(results), place_curves(results, table.metrics))):
        pictures.append(folder / f"report_{curves.name}.png")
        draw_curves(pictures[-1], curves)
        paths.append(_written(folder / f"report_{curves.name}.csv", curves_csv(curves)))
    codes = code_rows(results)
    if drawn := latent_pictures(config.tracker.uri, results):
        pictures.append(folder / f"report_{LATENTS_FILE}")
        lay_side_by_side(pictures[-1], drawn)
    texts = {
        "md": as_markdown(table, codes),
        "csv": as_csv(table),
        "tex": as_latex(table),
        "html": as_html(table, pictures, codes),
    }
    paths += [_written(folder / f"report.{ending}", text) for ending, text in texts.items()]
    tracker = MlflowTracker(uri=config.tracker.uri, experiment=config.tracker.experiment)
    tracker.start(f"{name}-{folder.name}", {}, {}, folder)
    for path in (*paths, *pictures):
        tracker.log_artifact(path)
    tracker.finish()
    print(texts["md"])
    print(f"Written to {folder.absolute()}: {', '.join(path.name for path in (*paths, *pictures))}")
    print(f"Browse the study: {tracker.how_to_open()}")


def _title(study: str) -> str:
    return next(option.description for option in options() if (option.group, option.name) == ("study", study))


def _written(path: Path, text: str) -> Path:
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")
    return path
