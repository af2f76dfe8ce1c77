"""A search: asks Optuna for values, has them tried, tells what came of them."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from filelock import FileLock

from motiongen.errors import InputError
from motiongen.runs import SUMMARY_FILE
from motiongen.search.naming import trial_folder
from motiongen.search.objectives import check_objectives, measured
from motiongen.search.space import Space
from motiongen.search.storage import open_storage, patiently
from motiongen.search.workers import Worker

if TYPE_CHECKING:
    from optuna import Study
    from optuna.samplers import BaseSampler
    from optuna.trial import FrozenTrial, Trial, TrialState

WORKER, OVERRIDES, REASON, REFUSED = "worker", "overrides", "reason", "refused"
"""What is noted of a trial."""
REFUSALS_IN_A_ROW = 200
REFUSALS_OF_SAMPLER = 5
"""After so many refused compositions one is drawn at random."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Asked:
    """A trial that is to be run."""

    number: int
    overrides: list[str]


class Budget:
    """How many trials, of all workers together, and for how long, of this one."""

    def __init__(self, trials: int, hours: float | None) -> None:
        self._trials = trials
        self._ends = None if hours is None else time.monotonic() + 3600 * hours

    def left(self, spent: int) -> int:
        """Trials that may still start."""
        if self._ends is not None and time.monotonic() > self._ends:
            return 0
        return max(0, self._trials - spent)


class Search:
    """One worker's view of a search that lies in a storage.

    Args:
        name: of the search; workers and later starts of the same name share its trials.
        place: of the storage.
        folder: where the trials' folders lie.
        objectives: metric to `minimize` or `maximize`.
        space: what is varied.
        sampler: of Optuna.
        budget: what may be spent.
        worker: this process.

    Raises:
        StorageError: the storage cannot be reached.
        ObjectiveError: an objective does not exist.
        InputError: a search of that name has other objectives.
    """

    def __init__(
        self,
        *,
        name: str,
        place: str,
        folder: Path,
        objectives: Mapping[str, str],
        space: Space,
        sampler: BaseSampler,
        budget: Budget,
        worker: Worker,
    ) -> None:
        import optuna
        from optuna.study import StudyDirection

        check_objectives(objectives)
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self.folder, self.space, self.objectives = folder, space, dict(objectives)
        self._place, self._budget, self._worker = place, budget, worker
        self._sampler = sampler
        self._own: dict[int, Trial] = {}
        self._turn = FileLock(folder / "search.lock")
        self.study: Study = patiently(
            lambda: optuna.create_study(
                study_name=name,
                storage=open_storage(place),
                sampler=sampler,
                directions=[StudyDirection[direction.upper()] for direction in objectives.values()],
                load_if_exists=True,
            ),
            place,
        )
        directions = [direction.name.lower() for direction in self.study.directions]
        if directions != list(objectives.values()):
            raise InputError(
                f"hydra.sweeper.objectives: the search {name} in {place} has {directions}; take another name"
            )

    def trials(self) -> list[FrozenTrial]:
        """All trials so far, of all workers."""
        found: list[FrozenTrial] = patiently(lambda: self.study.get_trials(deepcopy=False), self._place)
        return found

    def ask(self, refusal: Callable[[Sequence[str]], str | None]) -> Asked | None:
        """The next trial; None where the budget is spent.

        Compositions that `refusal` gives a reason against are noted as failed, cost nothing, and another is asked.

        Raises:
            InputError: nothing but refused compositions comes.
        """
        from optuna.samplers import RandomSampler
        from optuna.trial import TrialState

        with self._turn:
            if not self._budget.left(spent(self.trials())):
                return None
            for attempt in range(REFUSALS_IN_A_ROW):
                # Samplers learn nothing of what was refused, and may ask for it again and again.
                self.study.sampler = self._sampler if attempt < REFUSALS_OF_SAMPLER else RandomSampler()
                trial = patiently(lambda: self.study.ask(self.space.distributions), self._place)
                overrides = self.space.overrides(trial.params)
                trial.set_user_attr(WORKER, self._worker.name)
                trial.set_user_attr(OVERRIDES, overrides)
                self._own[trial.number] = trial
                reason = refusal(overrides)
                if reason is None:
                    return Asked(trial.number, overrides)
                trial.set_user_attr(REFUSED, reason)
                self._tell(trial.number, None, TrialState.FAIL)
        raise InputError(f"{REFUSALS_IN_A_ROW} compositions were refused one after another; the last: {reason}")

    def tell(self, number: int, error: BaseException | None) -> None:
        """What came of a trial: its objectives, or that it was pruned or failed, with the reason."""
        from optuna import TrialPruned
        from optuna.trial import TrialState

        if isinstance(error, TrialPruned):
            self._tell(number, None, TrialState.PRUNED)
            return
        values = None
        if error is None:
            try:
                values = measured(self.folder / trial_folder(number), list(self.objectives))
                error = None if values else FileNotFoundError("the job left no summary")
            except InputError as problem:
                error = problem
        if values is not None:
            self._tell(number, values, None)
            return
        reason = f"{type(error).__name__}: {error}"
        _log.warning("Trial %d failed: %s", number, reason)
        if number in self._own:
            patiently(lambda: self._own[number].set_user_attr(REASON, reason), self._place)
        self._tell(number, None, TrialState.FAIL)

    def take_over(self) -> None:
        """Settles the trials of workers that died: what they measured counts, what they left undone is tried again."""
        with self._turn:
            for one in self.trials():
                if not self._is_orphan(one):
                    continue
                if (self.folder / trial_folder(one.number) / SUMMARY_FILE).is_file():
                    self.tell(one.number, None)
                    _log.info("Trial %d was measured, but its worker died before it told; told now", one.number)
                    continue
                self.tell(one.number, InterruptedError("its worker died"))
                if one.params:
                    patiently(partial(self.study.enqueue_trial, one.params), self._place)
                    _log.info("Trial %d was left undone by a worker that died; its values are tried again", one.number)

    def _is_orphan(self, trial: FrozenTrial) -> bool:
        from optuna.trial import TrialState

        worker = str(trial.user_attrs.get(WORKER, ""))
        return trial.state is TrialState.RUNNING and not self._worker.is_alive(worker)

    def _tell(self, number: int, values: Sequence[float] | None, state: TrialState | None) -> None:
        patiently(lambda: self.study.tell(number, values, state, skip_if_finished=True), self._place)


def spent(trials: Sequence[FrozenTrial]) -> int:
    """Trials that the budget paid for: all that ran or run, but neither refused compositions nor interrupted ones."""
    from optuna.trial import TrialState

    return sum(
        one.state in (TrialState.RUNNING, TrialState.COMPLETE, TrialState.PRUNED)
        or (one.state is TrialState.FAIL and REASON in one.user_attrs)
        for one in trials
    )
