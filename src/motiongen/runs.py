"""Command lines that name an earlier run: what is wanted of it is checked before anything heavy is loaded.

With `resume` and `run`, its stored overrides stand in for what the user would have to type again.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterable, Set
from pathlib import Path

from motiongen.documents import DocumentError, read_json, read_yaml
from motiongen.errors import InputError
from motiongen.files import is_file
from motiongen.foreign import danger_in

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
TRUST = "trust=true"
"""Typed by who trusts the folders of runs on the command line."""


class RunError(InputError):
    """A folder that does not hold what is wanted of it."""


def completed(arguments: list[str]) -> list[str]:
    """A command line with `resume=<folder>` or `run=<folder>` made whole, and the folders of `init` and `runs` checked.

    Raises:
        RunError: the folder holds no run, or not what is needed to use it, or names code that is not installed.
    """
    resume, run, init = (_value(arguments, key) for key in ("resume", "run", "init"))
    trust = TRUST in arguments
    if init is not None:
        require_generator(init, "init")
        arguments = [*_without(arguments, {"init"}), _override("init", init)]
    arguments = [_runs(text) if text.startswith("runs=[") and text.endswith("]") else text for text in arguments]
    if resume is not None:
        return _resumed(arguments, resume, trust=trust)
    return arguments if run is None else _reopened(arguments, run, trust=trust)


def _resumed(arguments: list[str], folder: Path, *, trust: bool) -> list[str]:
    """The run goes on in its own folder, from the working folder in which it was started.

    So relative paths and the local MLflow database are what they were.
    """
    stored = stored_overrides(folder, "resume", {"resume"}, trust=trust)
    if not any(folder.rglob(CHECKPOINT)):
        raise RunError(f"resume: {folder} has no {CHECKPOINT} to go on from; start the run again")
    if rest := [text for text in arguments if _key(text) != "resume" and text != TRUST]:
        raise RunError(f"resume: the run goes on with the configuration it had; leave out {' '.join(rest)}")
    # Where it is gone, or was another machine's, the run goes on from here.
    with contextlib.suppress(OSError, ValueError):
        os.chdir(_started_in(folder))
    return [*stored, _override("resume", folder), _override("hydra.run.dir", folder)]


def _started_in(folder: Path) -> Path:
    try:
        content = read_yaml(folder / HYDRA)
    except DocumentError as error:
        raise RunError(f"resume: {folder / HYDRA}: {error}") from error
    for key in ("hydra", "runtime", "cwd"):
        content = content.get(key) if isinstance(content, dict) else None
    if not isinstance(content, str):
        raise RunError(f"resume: {folder / HYDRA}: hydra.runtime.cwd is not a path")
    return Path(content)


def _reopened(arguments: list[str], folder: Path, *, trust: bool) -> list[str]:
    """The run's configuration, and what is typed now on top of it."""
    require_generator(folder, "run")
    typed = _without(arguments, {"run"})
    kept = stored_overrides(folder, "run", {_key(text) for text in typed} | {"task", "run", "resume"}, trust=trust)
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
    _require_run(folder, key)
    if not is_file(folder / GENERATOR_FILE):
        raise RunError(f"{key}: {folder} has no {GENERATOR_FILE}: its training did not finish; resume={folder} goes on")


def _require_run(folder: Path, key: str) -> None:
    if not is_file(folder / OVERRIDES):
        raise RunError(f"{key}: {folder} is not the folder of a run (it has no {OVERRIDES})")


def stored_overrides(folder: Path, key: str, but: Set[str] = frozenset(), *, trust: bool = False) -> list[str]:
    """The overrides that the run in `folder` was started with.

    Args:
        folder: of the run.
        key: what named the folder, for messages.
        but: keys whose overrides are left out.
        trust: whether the overrides may name code that no installed option offers.

    Raises:
        RunError: it is not the folder of a run, or its overrides are damaged or not to be trusted.
    """
    _require_run(folder, key)
    path = folder / OVERRIDES
    try:
        content = read_yaml(path)
    except DocumentError as error:
        raise RunError(f"{key}: {path}: {error}") from error
    if not isinstance(content, list) or not all(isinstance(text, str) for text in content):
        raise RunError(f"{key}: {path}: is not a list of overrides")
    # Hydra keeps its own settings, and nobody can vouch for himself.
    kept = [text for text in _without(content, {"trust", *but}) if not _key(text).startswith("hydra")]
    for text in [] if trust else kept:
        if danger := danger_in(text):
            raise RunError(f"{key}: {path}: {text!r:.200} {danger}; add {TRUST} if you trust whoever made that folder")
    return kept


def known_tags(run: str | None) -> list[str] | None:
    """The tags of the data that the run in this folder was trained on, where its summary says them."""
    summary = Path(run or "") / SUMMARY_FILE
    if run is None or not is_file(summary):
        return None
    try:
        content = read_json(summary)
    except DocumentError as error:
        raise RunError(f"run: {summary}: {error}") from error
    for key in ("data", "tags"):
        content = content.get(key) if isinstance(content, dict) else None
    if not isinstance(content, list) or not all(isinstance(tag, str) for tag in content):
        raise RunError(f"run: {summary}: data.tags is not a list of tags")
    return content


def run_id_in(folder: Path) -> str:
    """The id in MLflow of the run that was begun in a folder; empty if there is none."""
    try:
        with (folder / RUN_ID_FILE).open("rb") as file:
            text = file.read(100).decode("ascii", errors="replace").strip()
    except OSError:
        return ""
    return text if RUN_ID.fullmatch(text) else ""


def _value(arguments: Iterable[str], key: str) -> Path | None:
    values = [text.partition("=")[2].strip("'\"") for text in arguments if text.startswith(f"{key}=")]
    return run_folder_of(values[-1]) if values and values[-1] not in ("null", "") else None


def run_folder_of(text: str) -> Path:
    """The folder that is meant by a folder's path, by the path of the generator's file in it, or by an MLflow run id.

    Ids are looked up below `runs/` in the working folder. What is none of these is taken for a folder.
    """
    path = Path(text).expanduser().absolute()
    if path.name == GENERATOR_FILE and is_file(path):
        return path.parent
    if RUN_ID.fullmatch(text) and not path.exists():
        for file in Path("runs").rglob(RUN_ID_FILE):
            if run_id_in(file.parent) == text:
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
