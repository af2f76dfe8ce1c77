"""Ends a search's trial early where it does worse than others did at the same point."""

from __future__ import annotations

from collections.abc import Sequence

import pytorch_lightning as pl
import torch

from motiongen.contracts import GeneratorModule, MotionBatch
from motiongen.evaluation.metrics.motion import joint_position_error
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.skeleton import Skeleton
from motiongen.search.storage import open_storage, patiently

LOOKS = 8
"""How often in a training it is judged."""


class PruneTrial(pl.Callback):
    """Generates for some held-out clips now and then, and tells Optuna how far the joints are from the clips'.

    Args:
        name, place, number: of the search, its storage and this trial.
        batches: held-out clips.
        skeleton: of the data.

    Raises:
        optuna.TrialPruned: in training, where the trial is not worth going on.
    """

    def __init__(self, name: str, place: str, number: int, batches: Sequence[MotionBatch], skeleton: Skeleton) -> None:
        import optuna

        self._place, self._batches, self._skeleton = place, batches, skeleton
        study = optuna.load_study(study_name=name, storage=open_storage(place))
        found = next(one for one in study.get_trials(deepcopy=False) if one.number == number)
        # How Optuna has a trial continued in another process; the id has no public name.
        self._trial = optuna.trial.Trial(study, found._trial_id)

    def on_train_epoch_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        import optuna

        epoch, every = trainer.current_epoch + 1, max(1, int(trainer.max_epochs or 1) // LOOKS)
        if epoch % every or epoch == trainer.max_epochs:
            return
        error = joint_error(pl_module.generator, self._batches, self._skeleton)  # type: ignore[arg-type]
        patiently(lambda: self._trial.report(error, epoch), self._place)
        if self._trial.should_prune():
            raise optuna.TrialPruned(f"epoch {epoch}: joints {error:.1f} cm off")


def joint_error(generator: GeneratorModule, batches: Sequence[MotionBatch], skeleton: Skeleton) -> float:
    """Mean distance between generated joints and the clips' own, centimetres."""
    was_training = generator.training
    generator.eval()
    errors = []
    with torch.no_grad():
        for batch in batches:
            made = joint_positions(generator.generate(batch.condition, seed=0), skeleton)
            errors.append(joint_position_error(made, joint_positions(batch.motion, skeleton), batch.condition.mask))
    generator.train(was_training)
    return float(torch.cat(errors).mean())
