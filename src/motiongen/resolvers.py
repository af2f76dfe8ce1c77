"""The functions that configuration files call, such as `${width:256}` and `${run_name:}`.

`scale` is a set of factors. A file states the paper's own size, `layers: ${depth:6}`, and the chosen scale shrinks it.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from omegaconf import Container, DictConfig, OmegaConf

from motiongen.search.naming import SEARCH, search_folder, trial_folder
from motiongen.studies.naming import chosen_row, study_folder, swept_study

WIDTH_STEP = 8
"""Widths stay multiples of this, so that attention heads divide them."""
LONGEST_RUN_NAME = 120
SHOWN_ELSEWHERE = {
    *("task", "experiment", "name", "data", "scale", "seed"),
    *("tracker", "cache", "run", "runs", "motions", "resume", "init", "data.source.root", "formats"),
    *("search", "study", "reuse", "retry_failed", "trust"),
}
"""Overrides that a run name shows in a place of their own, that are folders, or that change nothing about what runs."""
OF_LONG_MOTION = ("sequences", "corrections", "correction@")
"""How overrides begin that no training reads."""
SHOWN_ELSEWHERE_BELOW = ("tracker.", "ablation/", "trial.", "hydra")


def _factor(root: Container, name: str) -> float:
    value = OmegaConf.select(root, f"scale.{name}")
    if value is None:
        raise ValueError(f"scale.{name} is needed and not set; choose scale=paper, small or smoke")
    return float(value)


def _whole(value: float) -> int:
    return max(1, math.floor(value + 0.5))


def scaled_width(paper: int, *, _root_: Container) -> int:
    """A layer's width: the nearest multiple of 8, at least 8."""
    return WIDTH_STEP * _whole(paper * _factor(_root_, "width") / WIDTH_STEP)


def scaled_depth(paper: int, *, _root_: Container) -> int:
    """A number of layers, at least 1."""
    return _whole(paper * _factor(_root_, "depth"))


def scaled_heads(paper: int, *, _root_: Container) -> int:
    """A number of attention heads: a power of two where the paper's is, at least 1."""
    return _whole(paper * _factor(_root_, "heads"))


def scaled_dropout(paper: float, *, _root_: Container) -> float:
    return paper * _factor(_root_, "dropout")


def scaled_epochs(paper: int, *, _root_: Container) -> int:
    """A number of epochs, at least 1."""
    return _whole(paper * _factor(_root_, "epochs"))


def scaled_batch(paper: int, *, _root_: Container) -> int:
    """Motions of a training step, at least 1."""
    return _whole(paper * _factor(_root_, "batch"))


def capped_frames(paper: int, *, _root_: Container) -> int:
    """Frames of a window: the paper's, or the scale's longest where that is shorter."""
    return min(paper, int(_factor(_root_, "max_frames")))


def scaled_learning_rate(paper: float, *, _root_: Container) -> float:
    return paper * _factor(_root_, "learning_rate")


def default_cache() -> str:
    """Where prepared data and recognizers are kept: $MOTIONGEN_CACHE, or the platform's folder for caches."""
    if chosen := os.environ.get("MOTIONGEN_CACHE"):
        return str(Path(chosen).expanduser().absolute())
    from platformdirs import user_cache_dir

    return user_cache_dir("motiongen", appauthor=False)


def run_name(*, _root_: Container) -> str:
    """What runs, for folders and trackers: `marionette-builtin-small-s0`, then what the command line changed."""
    hydra = OmegaConf.select(_root_, "hydra") or HydraConfig.get()
    choices = hydra.runtime.choices
    row = chosen_row(choices)
    name = row.name if row else OmegaConf.select(_root_, "name")
    return _named(_root_, name, choices.get("task", "train"), hydra.overrides.task)


def changes_in(overrides: Iterable[str]) -> list[str]:
    """What a command line changes about a run, besides what the beginning of its name says, as it was typed."""
    keys = ((text.lstrip("+~").partition("=")[0], text) for text in overrides)
    return [text for key, text in keys if key not in SHOWN_ELSEWHERE and not key.startswith(SHOWN_ELSEWHERE_BELOW)]


def _named(root: Container, name: str | None, task: str, overrides: Iterable[str]) -> str:
    hydra = OmegaConf.select(root, "hydra") or HydraConfig.get()
    choices = hydra.runtime.choices
    parts = [str(part) for part in (name, None if task == "train" else task) if part]
    parts += [str(choices[group]) for group in ("data", "scale") if choices.get(group)]
    parts.append(f"s{OmegaConf.select(root, 'seed')}")
    for change in changes_in(overrides):
        key, _, value = change.lstrip("+~").partition("=")
        place = key.replace("/", ".").removeprefix("generator.")
        parts.append(f"{place}={value.strip('[]').replace(',', '+') or 'none'}")
    readable = re.sub(r"[^\w.=,+-]+", "_", "-".join(parts)).strip("_.")
    return readable[:LONGEST_RUN_NAME]


def sweep_folder(otherwise: str, *, _root_: Container) -> str:
    """Where the jobs of a multirun lie: those of a study or a search in its own folder, whenever they run."""
    hydra = OmegaConf.select(_root_, "hydra") or HydraConfig.get()
    if hydra.runtime.choices.get("hydra/sweeper") == SEARCH:
        return str(search_folder(hydra.sweeper.name))
    study = swept_study(hydra.overrides.task)
    if study is None:
        return otherwise
    return str(study_folder(study, hydra.runtime.choices["data"], hydra.runtime.choices["scale"]))


def sweep_subfolder(*, _root_: Container) -> str:
    """Where one job lies in it: a trial by its number, a row of a study by its name, another job by both."""
    hydra = OmegaConf.select(_root_, "hydra") or HydraConfig.get()
    number = OmegaConf.select(_root_, "trial.number")
    if number is not None:
        return trial_folder(number)
    name = run_name(_root_=_root_)
    return name if chosen_row(hydra.runtime.choices) else f"{hydra.job.num}-{name}"


def row_folder(row: str, *, _root_: Container) -> str:
    """Where a training lies that is another row, `row` of this study or `study/row`, with the same seed and changes.

    Changes of what long motion is judged on are no changes of a training.
    """
    hydra = OmegaConf.select(_root_, "hydra") or HydraConfig.get()
    own = chosen_row(hydra.runtime.choices)
    if own is None:
        raise ValueError(f"${{row_folder:{row}}} has a meaning in the rows of a study alone")
    study, _, name = row.rpartition("/")
    changes = [text for text in hydra.overrides.task if not text.lstrip("+~").startswith(OF_LONG_MOTION)]
    folder = study_folder(study or own.study, hydra.runtime.choices["data"], hydra.runtime.choices["scale"])
    return str(folder / _named(_root_, name, "train", changes))


def current_run_name(config: DictConfig) -> str:
    """The name of the run that is going on, which its folder bears too."""
    return run_name(_root_=config)


RESOLVERS: Mapping[str, Callable[..., Any]] = {
    "width": scaled_width,
    "depth": scaled_depth,
    "heads": scaled_heads,
    "dropout": scaled_dropout,
    "epochs": scaled_epochs,
    "batch": scaled_batch,
    "frames": capped_frames,
    "learning_rate": scaled_learning_rate,
    "default_cache": default_cache,
    "run_name": run_name,
    "row_folder": row_folder,
    "sweep_folder": sweep_folder,
    "sweep_subfolder": sweep_subfolder,
}


def register_resolvers() -> None:
    """Makes the functions known to OmegaConf; calling it again changes nothing."""
    for name, resolver in RESOLVERS.items():
        OmegaConf.register_new_resolver(name, resolver, replace=True)
