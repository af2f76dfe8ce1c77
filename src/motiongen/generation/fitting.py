"""One training run: epochs of batches, a progress bar, metrics to the tracker, a checkpoint after every epoch."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import pytorch_lightning as pl
from pytorch_lightning.callbacks import ModelCheckpoint
from tqdm import tqdm

from motiongen.contracts import MotionBatch
from motiongen.data.datamodule import MotionData
from motiongen.generation.divergence import StopDivergence
from motiongen.generation.lightning import TrainingShell
from motiongen.runs import CHECKPOINT
from motiongen.tracking.tracker import Tracker


class Epochs(pl.LightningDataModule):
    """The data's training batches, reshuffled every epoch by the epoch's number."""

    def __init__(self, data: MotionData) -> None:
        super().__init__()
        self._data = data

    def train_dataloader(self) -> Iterable[MotionBatch]:
        epoch = self.trainer.current_epoch if self.trainer else 0
        return self._data.train_batches(epoch)


class RunProgress(pl.Callback):
    """One bar for the whole run, with the time left."""

    def on_train_start(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        self._bar = tqdm(total=trainer.max_epochs, initial=trainer.current_epoch, desc="training", unit="epoch")

    def on_train_epoch_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        self._bar.set_postfix(loss=f"{float(trainer.callback_metrics['train/loss']):.4f}", refresh=False)
        self._bar.update()

    def on_train_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        self._bar.close()


class ReportLosses(pl.Callback):
    """Sends every epoch's mean loss terms to the tracker."""

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker

    def on_train_epoch_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        losses = {name: float(value) for name, value in trainer.callback_metrics.items()}
        self._tracker.log_metrics(losses, step=trainer.current_epoch)


def fit(
    shell: TrainingShell,
    data: MotionData,
    trainer: Callable[..., pl.Trainer],
    folder: Path,
    tracker: Tracker,
    *,
    resume: bool,
    callbacks: Sequence[pl.Callback] = (),
) -> None:
    """Train to the end of the run.

    Args:
        shell: what is trained, in place.
        data: its `train_batches`.
        trainer: `pytorch_lightning.Trainer` with the user's options bound.
        folder: where `last.ckpt` is written after every epoch, whole or not at all.
        tracker: gets the loss terms of every epoch.
        callbacks: further ones.
        resume: continue from `last.ckpt`, to the same weights as an uninterrupted run.

    Raises:
        Diverged: the loss is no number any more, or far above that of the first epoch.
    """
    checkpoint = ModelCheckpoint(
        dirpath=folder,
        filename=CHECKPOINT.removesuffix(".ckpt"),
        enable_version_counter=False,
        save_on_train_epoch_end=True,
        every_n_epochs=1,
    )
    options: dict[str, Any] = {
        "callbacks": [ReportLosses(tracker), RunProgress(), StopDivergence(), checkpoint, *callbacks],
        "logger": False,
        "enable_progress_bar": False,
        "enable_model_summary": False,
        "default_root_dir": folder,
        "reload_dataloaders_every_n_epochs": 1,
    }
    # Lightning asks torch in a way that torch has renamed; nothing that a user could mend.
    warnings.filterwarnings("ignore", message=".*LeafSpec.*is deprecated")
    last = folder / CHECKPOINT
    trainer(**options).fit(
        shell, datamodule=Epochs(data), ckpt_path=last if resume and last.exists() else None, weights_only=True
    )
