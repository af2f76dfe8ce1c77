"""One training run: epochs of batches, a progress bar, metrics to the tracker, a checkpoint after every epoch."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import pytorch_lightning as pl
from pytorch_lightning.callbacks import ModelCheckpoint
from torch import Tensor
from tqdm import tqdm

from motiongen.contracts import MotionBatch
from motiongen.data.datamodule import MotionData
from motiongen.errors import InputError
from motiongen.generation.divergence import StopDivergence
from motiongen.generation.lightning import TrainingShell
from motiongen.runs import CHECKPOINT
from motiongen.tracking.tracker import Tracker
from motiongen.weights import read_weights

CHECKPOINT_FIELDS = {"epoch": int, "global_step": int, "state_dict": dict, "optimizer_states": list, "loops": dict}
"""What Lightning writes and goes on from"""


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

    has_started = False
    """Whether what is gone on from was read"""

    def on_train_start(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        self.has_started = True
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
        InputError: `last.ckpt` is damaged, or of another composition.
    """
    last = folder / CHECKPOINT
    goes_on = resume and last.exists()
    if goes_on:
        require_resumable(last, shell)
    progress = RunProgress()
    checkpoint = ModelCheckpoint(
        dirpath=folder,
        filename=CHECKPOINT.removesuffix(".ckpt"),
        enable_version_counter=False,
        save_on_train_epoch_end=True,
        every_n_epochs=1,
    )
    options: dict[str, Any] = {
        "callbacks": [ReportLosses(tracker), progress, StopDivergence(), checkpoint, *callbacks],
        "logger": False,
        "enable_progress_bar": False,
        "enable_model_summary": False,
        "default_root_dir": folder,
        "reload_dataloaders_every_n_epochs": 1,
    }
    # Lightning asks torch in a way that torch has renamed; nothing that a user could mend.
    warnings.filterwarnings("ignore", message=".*LeafSpec.*is deprecated")
    try:
        trainer(**options).fit(shell, datamodule=Epochs(data), ckpt_path=last if goes_on else None, weights_only=True)
    except Exception as error:
        if not goes_on or progress.has_started:
            raise
        raise InputError(f"resume: {last}: {type(error).__name__}: {error!s:.500}") from error


def require_resumable(path: Path, shell: TrainingShell) -> None:
    """Raises InputError unless the file is a checkpoint of this training, as far as can be told before it is used."""
    try:
        content = read_weights(path)
    except ValueError as error:
        raise InputError(f"resume: {path}: not a checkpoint ({error})") from error
    fields: dict[str, Any] = content if isinstance(content, dict) else {}
    for field, kind in CHECKPOINT_FIELDS.items():
        if not isinstance(fields.get(field), kind):
            raise InputError(f"resume: {path}: field {field!r} is missing, or not a {kind.__name__}")
    found, expected = fields["state_dict"], shell.state_dict()
    if found.keys() != expected.keys():
        raise InputError(f"resume: {path}: field 'state_dict' is that of another composition")
    for name, value in expected.items():
        if not isinstance(found[name], Tensor) or found[name].shape != value.shape or found[name].dtype != value.dtype:
            raise InputError(f"resume: {path}: field 'state_dict': {name} is not {value.dtype} of {tuple(value.shape)}")
