"""Every data set from its files to a generator that was trained for a step and judged, at `scale=smoke`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hydra.utils import instantiate

from motiongen.configuration import compose
from motiongen.generation.lightning import TrainingShell
from motiongen.options_check import problems_in
from motiongen.tasks.assembly import build_data, build_generator
from motiongen.tasks.judging import judge
from tests.data.sources.miniatures import babel_corpus, humanact12_corpus, ntu13_corpus, smpl_corpus, uestc_corpus

CORPORA: dict[str, Callable[[Path], Path]] = {
    "babel": babel_corpus,
    "babel_60": babel_corpus,
    "babel_mag_auto": babel_corpus,
    "humanact12": humanact12_corpus,
    "uestc": uestc_corpus,
    "ntu13": ntu13_corpus,
    "smpl_folder": smpl_corpus,
}


@pytest.mark.parametrize("name", CORPORA)
def test_a_generator_is_trained_and_judged(name: str, tmp_path: Path) -> None:
    root = CORPORA[name](tmp_path / "data")
    config = compose(
        [
            *("+experiment=marionette", "scale=smoke", f"data={name}", f"data.source.root={root}"),
            *(f"cache={tmp_path / 'cache'}", "data.min_clips=2", "evaluation.seeds=1"),
        ]
    )
    assert problems_in(config, ["data"]) == []
    data = build_data(config)
    assert len(data.tags) >= 2
    generator = build_generator(config, data)
    shell = TrainingShell(
        generator, instantiate(config.objective), data.skeleton, instantiate(config.optimizer), config.seed
    )
    instantiate(config.trainer, max_steps=1, max_epochs=1, logger=False, enable_checkpointing=False).fit(
        shell, data.train_batches(0)
    )
    generator.eval().conclude(data.train_windows(8))
    (evaluation,) = judge(config, data, generator)
    assert evaluation.count == len(data.test_items())
    assert set(evaluation.systems) == {"real", "generated", "untrained"}
