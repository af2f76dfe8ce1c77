"""The command line: compose, check, then run the task under Hydra.

A module of its own, not `__main__`, so that launchers which run jobs in other processes can import it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

import hydra
from hydra._internal.utils import get_args_parser
from omegaconf import DictConfig, OmegaConf

from motiongen.configuration import HYDRA_VERSION_BASE, ConfigurationError, check, compose
from motiongen.discovery import PluginError, core_conf
from motiongen.resolvers import register_resolvers
from motiongen.tasks import TASKS

CHECKPOINT = "last.ckpt"
STORED_OVERRIDES = Path(".hydra", "overrides.yaml")
STORED_HYDRA = Path(".hydra", "hydra.yaml")

register_resolvers()


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs a command line (sys.argv by default). Exits with 1 and a message if something in it is wrong."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    try:
        arguments = resumed(arguments)
        if _checked(arguments):
            return
    except (ConfigurationError, PluginError) as error:
        sys.exit(f"motiongen: {error}")
    sys.argv[1:] = arguments
    application = hydra.main(version_base=HYDRA_VERSION_BASE, config_path=str(core_conf()), config_name="config")
    application(run_task)()


def _checked(arguments: list[str]) -> bool:
    """Checks a command line; True if that already answered it."""
    flags = get_args_parser().parse_args(arguments)
    if flags.hydra_help or flags.info or flags.shell_completion or flags.config_dir or flags.config_name:
        return False
    if flags.help or flags.cfg:
        if flags.overrides:
            compose(flags.overrides)
        return False
    config = check(flags.overrides, multirun=flags.multirun or "hydra.mode=MULTIRUN" in flags.overrides)
    if config.task.name != "list":
        return False
    TASKS["list"].run(config)  # needs no folder for its run
    return True


def run_task(config: DictConfig) -> None:
    """What Hydra calls for every job."""
    TASKS[config.task.name].run(config)


def resumed(arguments: list[str]) -> list[str]:
    """Replaces `resume=<folder>` by the command line that the run in that folder was started with.

    The run goes on in its own folder, and from the working folder in which it was started, so that relative paths and
    the local MLflow database are what they were.

    Raises:
        ConfigurationError: the folder holds no run, or one without a checkpoint, or more was asked for.
    """
    chosen = [argument for argument in arguments if argument.startswith("resume=") and argument != "resume=null"]
    if not chosen:
        return arguments
    folder = Path(chosen[-1].removeprefix("resume=").strip("'\"")).expanduser().absolute()
    if not (folder / STORED_OVERRIDES).is_file():
        raise ConfigurationError(f"resume: {folder} is not the folder of a run (it has no {STORED_OVERRIDES})")
    if not any(folder.rglob(CHECKPOINT)):
        raise ConfigurationError(f"resume: {folder} has no {CHECKPOINT} to go on from; start the run again")
    if rest := [argument for argument in arguments if argument not in chosen]:
        raise ConfigurationError(f"resume: the run goes on with the configuration it had; leave out {' '.join(rest)}")
    stored = [str(text) for text in OmegaConf.load(folder / STORED_OVERRIDES)]
    started_in = Path(OmegaConf.load(folder / STORED_HYDRA).hydra.runtime.cwd)
    if started_in.is_dir():
        os.chdir(started_in)
    kept = [text for text in stored if not text.startswith(("resume=", "hydra."))]
    quoted = str(folder).replace("'", "\\'")
    return [*kept, f"resume='{quoted}'", f"hydra.run.dir='{quoted}'"]
