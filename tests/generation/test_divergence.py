from __future__ import annotations

from pathlib import Path

import pytest
import pytorch_lightning as pl
import torch
from pytorch_lightning.callbacks import ModelCheckpoint
from torch import Tensor, nn
from torch.utils.data import DataLoader, TensorDataset

from motiongen.generation.divergence import Diverged, StopDivergence


class Losses(pl.LightningModule):
    """One step an epoch, whose losses are given; its weight counts the steps."""

    def __init__(self, losses: list[float]) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.zeros(()))
        self._losses = losses

    def configure_optimizers(self) -> torch.optim.Optimizer:
        return torch.optim.SGD(self.parameters(), lr=1.0)

    def training_step(self, batch: Tensor, batch_idx: int) -> Tensor:
        self.log("train/loss", torch.tensor(self._losses[self.current_epoch]), on_step=False, on_epoch=True)
        return -self.weight


def train(losses: list[float], folder: Path) -> None:
    checkpoint = ModelCheckpoint(dirpath=folder, filename="last", enable_version_counter=False, every_n_epochs=1)
    trainer = pl.Trainer(
        max_epochs=len(losses),
        callbacks=[StopDivergence(), checkpoint],
        accelerator="cpu",
        logger=False,
        enable_progress_bar=False,
        enable_model_summary=False,
    )
    trainer.fit(Losses(losses), DataLoader(TensorDataset(torch.zeros(1, 1)), batch_size=1))


@pytest.mark.parametrize("runaway", [float("nan"), float("inf"), 3.5e9])
def test_a_training_that_runs_away_is_ended_and_keeps_its_checkpoint(tmp_path: Path, runaway: float) -> None:
    with pytest.raises(Diverged, match=r"the loss is (nan|inf|3\.5e\+09) in epoch 3, after 0\.002 in the first"):
        train([0.002, 0.001, runaway, 0.001], tmp_path)
    kept = torch.load(tmp_path / "last.ckpt", weights_only=True)["state_dict"]["weight"]
    assert kept == 2


def test_a_term_that_is_ramped_up_is_no_divergence(tmp_path: Path) -> None:
    train([0.002, 0.02, 0.4, 1.5], tmp_path)
