"""Command lines that name an earlier run: what is wanted of it is checked before anything heavy is loaded.

With `resume` and `run`, its stored overrides stand in for what the user would have to type again.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable
from pathlib import Path

from omegaconf import OmegaConf

from motiongen.errors import InputError

CHECKPOINT = "last.ckpt"
"""What an interrupted run goes on from."""
GENERATOR_FILE = "generator.pt"
"""The trained generator of a finished run."""
OVERRIDES = Path(".hydra", "overrides.yaml")
HYDRA = Path(".hydra", "hydra.yaml")
SUMMARY_FILE = "summary.json"
"""What a finished run says about itself."""
RUN_ID_FILE = "mlflow_run_id"
"""Holds the id of the folder's run in MLflow."""
RUN_ID = re.compile("[0-9a-f]{32}")


class RunError(InputError):
    """A folder that does not hold what is wanted of it."""


def completed(arguments: list[str]) -> list[str]:
    """A command line with `resume=<folder>` or `run=<folder>` made whole, and the folders of `init` and `runs` checked.

    Raises:
        RunError: the folder holds no run, or not what is needed to use it.
    """
    resume, run, init = (_value(arguments, key) for key in ("resume", "run", "init"))
    if init is not None:
        require_generator(init, "init")
        arguments = [*_without(arguments, {"init"}), _override("init", init)]
    arguments = [_runs(text) if text.startswith("runs=[") and text.endswith("]") else text for text in arguments]
    if resume is not None:
        return _resumed(arguments, resume)
    return arguments if run is None else _reopened(arguments, run)


def _resumed(arguments: list[str], folder: Path) -> list[str]:
    """The run goes on in its own folder, from the working folder in which it was started.

    So relative paths and the local MLflow database are what they were.
    """
    stored = stored_overrides(folder, "resume")
    if not any(folder.rglob(CHECKPOINT)):
        raise RunError(f"resume: {folder} has no {CHECKPOINT} to go on from; start the run again")
    if rest := [text for text in arguments if _key(text) != "resume"]:
        raise RunError(f"resume: the run goes on with the configuration it had; leave out {' '.join(rest)}")
    started_in = Path(OmegaConf.load(folder / HYDRA).hydra.runtime.cwd)
    if started_in.is_dir():
        os.chdir(started_in)
    return [*_without(stored, {"resume"}), _override("resume", folder), _override("hydra.run.dir", folder)]


def _reopened(arguments: list[str], folder: Path) -> list[str]:
    """The run's configuration, and what is typed now on top of it."""
    stored = stored_overrides(folder, "run")
    require_generator(folder, "run")
    typed = _without(arguments, {"run"})
    again = {_key(text) for text in typed} | {"task", "run", "resume"}
    kept = _without(stored, again)
    return [*kept, *typed, _override("run", folder)]


def _runs(argument: str) -> str:
    """`runs=[a,b]` with whole paths in quotes: the names of runs hold `=`, at which the list could not be read."""
    names = [name.strip().strip("'\"") for name in argument.removeprefix("runs=[").removesuffix("]").split(",")]
    folders = [run_folder_of(name) for name in names if name]
    for folder in folders:
        require_generator(folder, "runs")
    return f"runs=[{','.join(quoted(folder) for folder in folders)}]"


def require_generator(folder: Path, key: str) -> None:
    """Raises RunError unless the folder is that of a run which finished its training."""
    stored_overrides(folder, key)
    if not (folder / GENERATOR_FILE).is_file():
        raise RunError(f"{key}: {folder} has no {GENERATOR_FILE}: its training did not finish; resume={folder} goes on")


def stored_overrides(folder: Path, key: str) -> list[str]:
    """The overrides that the run in `folder` was started with; `key` is what named the folder.

    Raises:
        RunError: it is not the folder of a run.
    """
    if not (folder / OVERRIDES).is_file():
        raise RunError(f"{key}: {folder} is not the folder of a run (it has no {OVERRIDES})")
    return [str(text) for text in OmegaConf.load(folder / OVERRIDES)]


def known_tags(run: str | None) -> list[str] | None:
    """The tags of the data that the run in this folder was trained on, where its summary says them."""
    summary = Path(run or "") / SUMMARY_FILE
    if run is None or not summary.is_file():
        return None
    try:
        tags = json.loads(summary.read_text(encoding="utf-8"))["data"]["tags"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunError(f"run: {summary} cannot be read: {error}") from error
    return [str(tag) for tag in tags]


def _value(arguments: Iterable[str], key: str) -> Path | None:
    values = [text.partition("=")[2].strip("'\"") for text in arguments if text.startswith(f"{key}=")]
    return run_folder_of(values[-1]) if values and values[-1] not in ("null", "") else None


def run_folder_of(text: str) -> Path:
    """The folder that is meant by a folder's path, by the path of the generator's file in it, or by an MLflow run id.

    Ids are looked up below `runs/` in the working folder. What is none of these is taken for a folder.
    """
    path = Path(text).expanduser().absolute()
    if path.is_file() and path.name == GENERATOR_FILE:
        return path.parent
    if RUN_ID.fullmatch(text) and not path.exists():
        for file in Path("runs").rglob(RUN_ID_FILE):
            if file.read_text(encoding="utf-8").strip() == text:
                return file.parent.absolute()
        raise RunError(f"no folder below {Path('runs').absolute()} is that of the MLflow run {text}")
    return path


def _key(text: str) -> str:
    return text.lstrip("+~").partition("=")[0]


def _without(texts: Iterable[str], keys: set[str]) -> list[str]:
    return [text for text in texts if _key(text) not in keys]


def _override(key: str, folder: Path) -> str:
    return f"{key}={quoted(folder)}"


def quoted(value: str | Path) -> str:
    """A value as Hydra's command line takes any text."""
    text = str(value).replace("\\", "\\\\").replace("'", "\\'")
    return f"'{text}'"
