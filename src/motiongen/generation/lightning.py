"""The Lightning shell around a generator and an objective: no network code, no weights of loss terms."""

from __future__ import annotations

import pytorch_lightning as pl
import torch
from pytorch_lightning.utilities.types import OptimizerLRScheduler
from torch import Tensor
from torch.optim.lr_scheduler import LambdaLR

from motiongen.contracts import GeneratorModule, MotionBatch
from motiongen.generation.optimization import Optimization
from motiongen.motion.skeleton import Skeleton
from motiongen.objectives.objective import Objective

STREAMS = {"code": 0, "dropout": 1}


def step_seed(seed: int, step: int, stream: str) -> int:
    """The seed of one random stream in one training step.

    It depends on nothing but its arguments, so a resumed run draws what an uninterrupted one would have drawn.
    """
    return ((seed * 1_000_003 + step) * len(STREAMS) + STREAMS[stream]) % 2**63


class TrainingShell(pl.LightningModule):
    """Trains a generator by an objective.

    Args:
        generator: the model.
        objective: its loss.
        skeleton: the mean shape of the data.
        optimization: its optimizer and learning rate.
        seed: of every random draw in training.
    """

    def __init__(
        self,
        generator: GeneratorModule,
        objective: Objective,
        skeleton: Skeleton,
        optimization: Optimization,
        seed: int,
    ) -> None:
        super().__init__()
        self.generator = generator
        self.objective = objective
        self.skeleton = skeleton
        self._optimization = optimization
        self._seed = seed

    def configure_optimizers(self) -> OptimizerLRScheduler:
        optimizer = self._optimization.optimizer(self.generator.parameters())
        steps = max(1, int(self.trainer.estimated_stepping_batches))
        schedule = LambdaLR(optimizer, lambda step: self._optimization.factor(min(1.0, (step + 1) / steps)))
        return {"optimizer": optimizer, "lr_scheduler": {"scheduler": schedule, "interval": "step"}}

    @property
    def progress(self) -> float:
        """The share of the run's epochs that is done, in [0, 1]."""
        return self.current_epoch / (self.trainer.max_epochs or 1)

    def on_train_batch_start(self, batch: MotionBatch, batch_idx: int) -> None:
        # Dropout draws from torch's global generator, which takes no argument.
        torch.manual_seed(step_seed(self._seed, self.global_step, "dropout"))

    def training_step(self, batch: MotionBatch, batch_idx: int) -> Tensor:
        generator = torch.Generator().manual_seed(step_seed(self._seed, self.global_step, "code"))
        prediction = self.generator.reconstruct(batch, self.progress, generator)
        terms = self.objective.terms(prediction, batch, self.skeleton)
        total = self.objective.total(terms, self.progress)
        self.log_dict(
            {f"train/{name}": value.detach() for name, value in terms.items()},
            on_step=False,
            on_epoch=True,
            batch_size=len(batch.motion),
        )
        self.log(
            "train/loss", total.detach(), on_step=False, on_epoch=True, prog_bar=True, batch_size=len(batch.motion)
        )
        return total
