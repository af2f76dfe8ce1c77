from __future__ import annotations

import pytest
from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

from motiongen.search.space import Space, SpaceError


def test_hydras_sweeps_become_optunas_distributions() -> None:
    space = Space(
        {
            "generator/encoder": "choice(token_pooling, gru_encoder)",
            "generator.width": "range(64, 257, 64)",
            "optimizer.optimizer.lr": "tag(log, interval(1e-4, 1e-2))",
            "dropout": "interval(0.0, 0.5)",
        },
        {},
    )
    assert space.distributions == {
        "generator/encoder": CategoricalDistribution(["token_pooling", "gru_encoder"]),
        "generator.width": IntDistribution(64, 256, step=64),
        "optimizer.optimizer.lr": FloatDistribution(1e-4, 1e-2, log=True),
        "dropout": FloatDistribution(0.0, 0.5),
    }


def test_a_bundle_stands_for_all_of_its_overrides() -> None:
    bundles = {"decoder": {"gru": ["generator/decoder=gru_decoder", "generator/unroller/query=[]"], "other": ["a=1"]}}
    space = Space({"seed": "range(0, 3)"}, bundles)
    assert space.overrides({"seed": 2, "decoder": "gru"}) == ["seed=2", *bundles["decoder"]["gru"]]
    assert space.single_choices() == [bundles["decoder"]["gru"], ["a=1"]]


@pytest.mark.parametrize(
    ("sweeps", "told"),
    [
        ({}, "nothing to search"),
        ({"seed": "7"}, r"space\.seed=7: takes choice"),
        ({"seed": "choice(1,"}, r"space\.seed=choice\(1,"),
        ({"seed": "interval(0, 1"}, r"space\.seed"),
    ],
)
def test_what_cannot_be_searched_is_named(sweeps: dict[str, str], told: str) -> None:
    with pytest.raises(SpaceError, match=told):
        Space(sweeps, {})
