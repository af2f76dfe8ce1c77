"""From the first trial of a search to its report, between Hydra's launcher and Optuna."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.utils import JobStatus
from hydra.errors import HydraException
from hydra.utils import instantiate
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from motiongen.data.clips import INITIAL_FRAMES
from motiongen.errors import input_error
from motiongen.motion.representation import FEATURES
from motiongen.options_check import problems_in
from motiongen.runs import SUMMARY_FILE, quoted
from motiongen.search.naming import trial_folder
from motiongen.search.report import write_report
from motiongen.search.search import Asked, Budget, Search
from motiongen.search.space import Space, SpaceError
from motiongen.search.workers import Worker
from motiongen.tasks import TASKS

if TYPE_CHECKING:
    from hydra_plugins.motiongen_search import OptunaSearch

TAGS = 2
"""Of the composition that is built to see whether it can be."""
_log = logging.getLogger(__name__)


def drive(sweeper: OptunaSearch, arguments: Sequence[str]) -> None:
    """Run trials until the budget is spent, then write what was found.

    Args:
        sweeper: its settings.
        arguments: the command line; what it sweeps over is searched, too.

    Raises:
        InputError: the space, the objectives or the storage are wrong.
    """
    base, sweeps = _divided(arguments)
    space = Space({**sweeper.space, **sweeps}, sweeper.bundles)
    _require_composable(sweeper, base, space)
    folder = Path(sweeper.config.hydra.sweep.dir)
    tracker = instantiate(sweeper.config.tracker)
    with Worker(folder / "workers") as worker:
        search = Search(
            name=sweeper.name,
            place=sweeper.storage,
            folder=folder,
            objectives=sweeper.objectives,
            space=space,
            sampler=sweeper.sampler,
            budget=Budget(sweeper.trials, sweeper.hours),
            worker=worker,
        )
        search.take_over()
        tracker.start(f"search-{sweeper.name}", {}, {"search": sweeper.name}, folder)
        while batch := _next(sweeper, search, base):
            _run(sweeper, search, base, batch)
            search.take_over()
        for path in write_report(search, base):
            tracker.log_artifact(path)
        tracker.finish()


def _next(sweeper: OptunaSearch, search: Search, base: Sequence[str]) -> list[Asked]:
    """As many trials as the launcher takes at a time; fewer, or none, at the end of the budget."""

    def refusal(overrides: Sequence[str]) -> str | None:
        return why_not(sweeper.hydra_context.config_loader.load_sweep_config(sweeper.config, [*base, *overrides]))

    asked = (search.ask(refusal) for _ in range(sweeper.jobs))
    return [one for one in asked if one is not None]


def _run(sweeper: OptunaSearch, search: Search, base: Sequence[str], batch: Sequence[Asked]) -> None:
    lines = [[*base, *one.overrides, *_identity(sweeper, one.number)] for one in batch]
    try:
        returns = sweeper.launcher.launch(lines, initial_job_idx=batch[0].number)
    except Exception as error:  # a launcher whose worker died; what its jobs finished counts
        _log.exception("The launcher broke off")
        for one in batch:
            search.tell(
                one.number, None if (search.folder / trial_folder(one.number) / SUMMARY_FILE).is_file() else error
            )
        return
    for one, job in zip(batch, returns, strict=True):
        search.tell(one.number, None if job.status is JobStatus.COMPLETED else job._return_value)


def _identity(sweeper: OptunaSearch, number: int) -> list[str]:
    """What tells a job which trial it is."""
    prune = str(sweeper.prune and len(sweeper.objectives) == 1).lower()
    place = quoted(sweeper.storage)
    return [f"trial.name={sweeper.name}", f"trial.storage={place}", f"trial.number={number}", f"trial.prune={prune}"]


def why_not(config: DictConfig) -> str | None:
    """Why a trial cannot run; None where its options are right and its composition, if it has one, can be built."""
    try:
        reads = TASKS[config.task.name].reads
        if problems := problems_in(config, reads):
            return problems[0].splitlines()[0]
        if "generator" in reads:
            instantiate(config.generator)(features=FEATURES, tags=TAGS, initial_frames=INITIAL_FRAMES, styles=0)
    except Exception as error:
        if cause := input_error(error):
            return str(cause)
        raise
    return None


def _divided(arguments: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """What every trial has, and what the command line sweeps over."""
    parsed = OverridesParser.create().parse_overrides(list(arguments))
    base = [str(one.input_line) for one in parsed if not one.is_sweep_override()]
    sweeps = {one.get_key_element(): str(one.input_line).partition("=")[2] for one in parsed if one.is_sweep_override()}
    return base, sweeps


def _require_composable(sweeper: OptunaSearch, base: Sequence[str], space: Space) -> None:
    """Raises SpaceError if one of the choices does not exist, before anything is trained."""
    for line in space.single_choices():
        try:
            sweeper.hydra_context.config_loader.load_sweep_config(sweeper.config, [*base, *line])
        except (HydraException, OmegaConfBaseException) as error:
            raise SpaceError(f"hydra.sweeper: {' '.join(line)}: {str(error).splitlines()[0]}") from error
