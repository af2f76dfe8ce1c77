"""`task=report results=[...]`: what earlier runs measured, side by side where it compares."""

from __future__ import annotations

from omegaconf import DictConfig

from motiongen.evaluation.stored import alike, read_result, result_rows
from motiongen.evaluation.table import markdown
from motiongen.runs import run_folder_of


def run(config: DictConfig) -> None:
    """Print a table for every group of results that were measured alike, and what the others differ in."""
    groups = alike(read_result(run_folder_of(named)) for named in config.results)
    for number, group in enumerate(groups):
        if number:
            print(f"\nThese do not compare with those of {groups[0][0].name}:")
            print("\n".join(f"- {text}" for text in groups[0][0].differences(group[0])), end="\n\n")
        print(markdown(result_rows(group)))
