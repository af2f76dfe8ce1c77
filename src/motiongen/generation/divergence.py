"""Ends a training that has run away, before more time is spent on it."""

from __future__ import annotations

import math

import pytorch_lightning as pl

from motiongen.errors import InputError

HOPELESS = 1000.0
"""Times the loss of the first epoch; a ramp of a term's weight stays far below it."""


class Diverged(InputError):
    """The loss of an epoch is no number, or far above that of the first."""


class StopDivergence(pl.Callback):
    """Raises Diverged at the end of an epoch, before its checkpoint would replace that of the one before."""

    def __init__(self) -> None:
        self._first: float | None = None

    def on_train_epoch_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        loss = float(trainer.callback_metrics["train/loss"])
        self._first = loss if self._first is None else self._first
        if not math.isfinite(loss) or abs(loss) > HOPELESS * abs(self._first):
            raise Diverged(
                f"the training diverged: the loss is {loss:.3g} in epoch {trainer.current_epoch + 1}, after "
                f"{self._first:.3g} in the first. The checkpoint is that of the epoch before. What often helps: a "
                f"lower optimizer.optimizer.lr, trainer.gradient_clip_val=1.0, objective.ramps=null if KL is annealed"
            )
