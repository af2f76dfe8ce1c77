from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from omegaconf import OmegaConf

from motiongen.configuration import compose
from motiongen.resolvers import register_resolvers

FACTORS = {
    "width": 0.5,
    "depth": 0.5,
    "heads": 0.125,
    "dropout": 0.5,
    "epochs": 0.01,
    "batch": 0.33,
    "learning_rate": 5.0,
    "max_frames": 60,
}


def resolved(expression: str, **factors: float) -> Any:
    register_resolvers()
    return OmegaConf.create({"scale": FACTORS | factors, "value": expression}).value


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("${width:256}", 128),
        ("${width:100}", 48),  # 50 lies between 48 and 56
        ("${width:4}", 8),
        ("${depth:6}", 3),
        ("${depth:5}", 3),
        ("${depth:1}", 1),
        ("${heads:8}", 1),
        ("${heads:4}", 1),
        ("${epochs:1000}", 10),
        ("${epochs:10}", 1),
        ("${dropout:0.1}", 0.05),
        ("${batch:30}", 10),
        ("${batch:1}", 1),
        ("${frames:200}", 60),
        ("${frames:48}", 48),
        ("${learning_rate:1.0e-4}", 5e-4),
    ],
)
def test_the_scale_shrinks_sizes_and_keeps_them_usable(expression: str, expected: float) -> None:
    value = resolved(expression)
    assert value == pytest.approx(expected)
    assert type(value) is type(expected)


def test_a_factor_of_one_changes_nothing() -> None:
    assert resolved("${width:1024}", width=1.0) == 1024
    assert resolved("${dropout:0.1}", dropout=1.0) == 0.1


def test_the_cache_is_chosen_by_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("MOTIONGEN_CACHE", str(tmp_path))
    assert compose().cache == str(tmp_path)
    monkeypatch.delenv("MOTIONGEN_CACHE")
    assert Path(compose().cache).is_absolute()


@pytest.mark.parametrize(
    ("overrides", "name"),
    [
        (["+experiment=marionette"], "marionette-builtin-small-s0"),
        (["+experiment=marionette", "data=bandai", "scale=smoke", "seed=3"], "marionette-bandai-smoke-s3"),
        (
            ["+experiment=marionette", "generator.encoder.layers=2", "generator/unroller/branches=[]", "tracker=none"],
            "marionette-builtin-small-s0-encoder.layers=2-unroller.branches=none",
        ),
        (["task=prepare", "data=bandai", "data.source.root=/a/b"], "prepare-bandai-small-s0"),
        (["+experiment=marionette", "task=synthesize", "formats=[bvh,glb]"], "marionette-synthesize-builtin-small-s0"),
    ],
)
def test_a_run_is_named_by_what_runs(overrides: list[str], name: str) -> None:
    config = compose(overrides, with_hydra=True)
    assert OmegaConf.select(config, "hydra.run.dir").split("/")[1] == name


def test_run_names_stay_short_enough_for_a_folder() -> None:
    config = compose(["+experiment=marionette", f"+generator.text={'x' * 500}"], with_hydra=True)
    assert len(OmegaConf.select(config, "hydra.run.dir").split("/")[1]) <= 120


def test_a_row_finds_the_training_of_another_row_and_of_another_study() -> None:
    """With the seed and the changes that its own command line has, but for those that only long motion reads."""
    changes = ["seed=2", "scale=smoke", "data.draws=3"]
    trained = compose(["+ablation/marionet_next_tag=without_next_tag", *changes], with_hydra=True)
    folder = f"runs/studies/marionet_next_tag/builtin-smoke/{OmegaConf.select(trained, 'hydra.run.dir').split('/')[1]}"
    assert folder.endswith("without_next_tag-builtin-smoke-s2-data.draws=3")
    judged = [
        "+ablation/long_motion_next_tag=without_next_tag",
        *changes,
        "sequences.count=3",
        "corrections=shadow_start",
    ]
    config = compose(judged, with_hydra=True)
    assert config.task.name == "long_motion"
    assert list(config.runs) == [folder]
    tuned = compose(["+ablation/actor_variable_length=variable", "seed=1"], with_hydra=True)
    assert tuned.init == "runs/studies/actor_variable_length/builtin-small/fixed-builtin-small-s1"
