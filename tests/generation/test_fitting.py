from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import torch
from hydra.utils import instantiate

from motiongen.configuration import compose
from motiongen.data.datamodule import MotionData
from motiongen.errors import InputError
from motiongen.generation.fitting import fit
from motiongen.generation.lightning import TrainingShell
from motiongen.tasks.assembly import build_data, build_generator
from motiongen.tracking.none import NoTracker

OVERRIDES = ("+experiment=actor", "scale=smoke", "data.source.sessions=8", "data.min_clips=2")


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> MotionData:
    return build_data(compose([*OVERRIDES, f"cache={tmp_path_factory.mktemp('cache')}"]))


def trained(data: MotionData, folder: Path, epochs: int) -> TrainingShell:
    """Goes on where the folder has a checkpoint."""
    config = compose(OVERRIDES)
    generator = build_generator(config, data)
    shell = TrainingShell(generator, instantiate(config.objective), data.skeleton, instantiate(config.optimizer), 0)
    trainer = partial(instantiate, config.trainer, max_epochs=epochs)
    fit(shell, data, trainer, folder, NoTracker(), resume=True)
    return shell


def without(field: str) -> Callable[[dict[str, Any]], None]:
    return lambda content: content.pop(field)


def other_weights(content: dict[str, Any]) -> None:
    name = next(iter(content["state_dict"]))
    content["state_dict"][name] = content["state_dict"][name][..., None]


def other_loops(content: dict[str, Any]) -> None:
    content["loops"] = {"fit_loop": 3}


def other_optimizer(content: dict[str, Any]) -> None:
    content["optimizer_states"] = [{"state": {}, "param_groups": []}]


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (without("state_dict"), "field 'state_dict' is missing"),
        (other_weights, "field 'state_dict': .* is not torch.float32 of"),
        (other_loops, ""),
        (other_optimizer, ""),
    ],
)
def test_a_checkpoint_that_cannot_be_gone_on_from_is_named(
    data: MotionData, tmp_path: Path, damage: Callable[[dict[str, Any]], None], told: str
) -> None:
    trained(data, tmp_path, 1)
    content = torch.load(tmp_path / "last.ckpt", weights_only=True)
    damage(content)
    torch.save(content, tmp_path / "last.ckpt")
    with pytest.raises(InputError, match=rf"resume: .*last\.ckpt: .*{told}"):
        trained(data, tmp_path, 2)
