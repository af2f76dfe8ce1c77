"""Hydra's sweeper for `hydra/sweeper=search`. Light, as Hydra imports every plugin at every start."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from hydra.core.plugins import Plugins
from hydra.plugins.launcher import Launcher
from hydra.plugins.sweeper import Sweeper
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, OmegaConf

if TYPE_CHECKING:
    from optuna.samplers import BaseSampler


class OptunaSearch(Sweeper):
    """Lets Optuna choose the values of a multirun; several processes that are given the same name share the work.

    Args:
        name: of the search.
        storage: a journal file, or a database's address such as sqlite:///search.db.
        objectives: metric to `minimize` or `maximize`, the lowest FID if there are none; of several, the Pareto set is
            kept.
        space: key or group to a sweep, as `motiongen.search.space` reads them.
        bundles: name to options, each a list of overrides that go together.
        sampler: of Optuna.
        trials: how many, of all workers and starts together.
        hours: after which no trial is begun; null for no limit.
        jobs: trials that are given to the launcher at a time.
        prune: whether trials of a single objective end early where they do worse than others.
    """

    def __init__(
        self,
        *,
        name: str,
        storage: str,
        objectives: Mapping[str, str],
        space: Mapping[str, str],
        bundles: Mapping[str, Mapping[str, Sequence[str]]],
        sampler: BaseSampler,
        trials: int,
        hours: float | None,
        jobs: int,
        prune: bool,
    ) -> None:
        self.name, self.storage = name, storage
        self.objectives = dict(objectives) or {"fid": "minimize"}
        self.space, self.bundles, self.sampler = dict(space), _plain(bundles), sampler
        self.trials, self.hours, self.jobs, self.prune = trials, hours, jobs, prune

    hydra_context: HydraContext
    config: DictConfig
    launcher: Launcher

    def setup(self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig) -> None:
        self.hydra_context, self.config = hydra_context, config
        self.launcher = Plugins.instance().instantiate_launcher(
            hydra_context=hydra_context, task_function=task_function, config=config
        )

    def sweep(self, arguments: list[str]) -> None:
        """Runs trials until the budget is spent."""
        from motiongen.errors import InputError
        from motiongen.search.driver import drive

        try:
            drive(self, arguments)
        except InputError as error:
            sys.exit(f"motiongen: {error}")


def _plain(node: Any) -> Any:
    return OmegaConf.to_container(node, resolve=True) if OmegaConf.is_config(node) else node
