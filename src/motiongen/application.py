"""The command line: compose, check, then run the task under Hydra.

A module of its own, not `__main__`, so that launchers which run jobs in other processes can import it.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path

import hydra
from hydra._internal.utils import get_args_parser
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig

from motiongen.configuration import HYDRA_VERSION_BASE, check, compose
from motiongen.discovery import core_conf, options
from motiongen.errors import InputError, input_error
from motiongen.resolvers import register_resolvers
from motiongen.runs import completed
from motiongen.studies.naming import chosen_row
from motiongen.tasks import TASKS
from motiongen.usage import help_text

MULTIRUN = ("-m", "--multirun")
QUOTED = ("'", '"', "[", "{", "$", "null", "???")
"""How a value begins that Hydra reads as it is meant"""

register_resolvers()


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs a command line (sys.argv by default). Exits with 1 and a message if something in it is wrong."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    arguments.sort(key=lambda text: text not in MULTIRUN)  # argparse wants flags before or after all overrides
    if not any(text in MULTIRUN for text in arguments):
        arguments = [with_quotes(text) for text in arguments]
    try:
        arguments = completed(arguments)
        if _answered(arguments):
            sys.stdout.flush()
            return
    except BrokenPipeError:
        # The reader has seen enough (`| head`). What it did not read would be written once more at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return
    except InputError as error:
        sys.exit(f"motiongen: {error}")
    sys.argv[1:] = arguments
    application = hydra.main(version_base=HYDRA_VERSION_BASE, config_path=str(core_conf()), config_name="config")
    application(run_task)()


def with_quotes(argument: str) -> str:
    """A one-line timeline as the shell hands it on, without quotes: Hydra would take its commas for a choice."""
    key, _, value = argument.partition("=")
    if key != "timeline" or not value or value.startswith(QUOTED):
        return argument
    escaped = re.sub(r"(\\+)(?='|$)", r"\1\1", value).replace("'", r"\'")  # a backslash counts before a quote alone
    return f"timeline='{escaped}'"


def _answered(arguments: list[str]) -> bool:
    """Checks a command line; True if it asked for nothing but an answer that can be given at once."""
    flags = get_args_parser().parse_args(arguments)
    if flags.help:
        print(help_text(options()))
        return True
    if flags.hydra_help or flags.info or flags.shell_completion or flags.config_dir or flags.config_name:
        return False
    if flags.cfg:
        compose(flags.overrides)
        return False
    config = check(flags.overrides, multirun=flags.multirun or "hydra.mode=MULTIRUN" in flags.overrides)
    if not TASKS[config.task.name].answers:
        return False
    run_task(config)
    return True


def run_task(config: DictConfig) -> None:
    """What Hydra calls for every job. What is wrong with files or a composition is told without a trace.

    A trial's error goes to its search, which has others to run.
    """
    task = TASKS[config.task.name].run
    try:
        if _is_row():
            from motiongen.studies.rows import run_row

            run_row(task, config, Path(HydraConfig.get().runtime.output_dir))
        else:
            task(config)
    except Exception as error:
        if (cause := input_error(error)) and config.trial.number is None:
            sys.exit(f"motiongen: {cause}")
        raise


def _is_row() -> bool:
    """Whether this job is one row of a study."""
    if not HydraConfig.initialized() or HydraConfig.get().mode is not RunMode.MULTIRUN:
        return False
    return chosen_row(HydraConfig.get().runtime.choices) is not None
