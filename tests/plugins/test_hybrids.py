"""The experiments that mix papers' mechanisms: composed by Hydra as a user would, trained for a step, used."""

from __future__ import annotations

import pytest
import torch
from hydra.utils import instantiate

from motiongen.configuration import check
from motiongen.motion.representation import FEATURES
from tests.compositions import INITIAL_FRAMES, TAGS, batch, skeleton

EXPERIMENTS = {
    "um_cvae": ("FiLM", "LinearTime", "GRUDecoder", {"latent_reinforcement"}, set()),
    "um_cvae_time_unrolling": (
        "FiLM",
        "TimeUnrolling",
        "GRUDecoder",
        {"latent_reinforcement"},
        {"reverse_positional_encoding"},
    ),
    "marionette_film": (
        "FiLM",
        "TimeUnrolling",
        "AutoregressiveTransformer",
        set(),
        {"reverse_positional_encoding"},
    ),
    "marionette_latent_reinforcement": (
        "Unconditioned",
        "TimeUnrolling",
        "AutoregressiveTransformer",
        {"latent_reinforcement"},
        {"reverse_positional_encoding", "tag_injection"},
    ),
}


def compose(experiment: str):
    return check([f"+experiment={experiment}", "scale=smoke"])


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_an_experiment_inherits_its_paper_and_changes_what_it_says(experiment):
    config = compose(experiment)
    stages = config.generator
    conditioning, unroller, decoder, layer_input, query = EXPERIMENTS[experiment]
    assert config.name == experiment
    assert stages.conditioning._target_.endswith(f".{conditioning}")
    assert stages.unroller._target_.endswith(f".{unroller}")
    assert stages.decoder._target_.endswith(f".{decoder}")
    assert set(stages.decoder.layer_input) == layer_input
    assert set(stages.unroller.get("query", {})) == query
    parent = compose("um_cvae" if experiment.startswith("um_cvae") else "marionette")
    for key in ("data", "objective", "optimizer", "trainer"):
        assert config[key] == parent[key], key


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_an_experiment_learns_from_a_batch_and_generates(experiment):
    config = compose(experiment)
    torch.manual_seed(0)
    generator = instantiate(config.generator)(features=FEATURES, tags=TAGS, initial_frames=INITIAL_FRAMES)
    objective, data = instantiate(config.objective), batch((9, 5, 12))
    optimizer = torch.optim.Adam(generator.parameters(), lr=1e-3)
    losses = []
    for _ in range(5):
        torch.manual_seed(0)  # the same dropout and the same noise, so that the loss has to fall
        prediction = generator.reconstruct(data, 1.0, torch.Generator().manual_seed(0))
        loss = objective.total(objective.terms(prediction, data, skeleton()), 1.0)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    assert losses[-1] < losses[0]
    generator.eval().conclude([data])
    for frames in (1, 20, 60, 200):
        motion = generator.generate(batch((frames,)).condition, seed=0)
        assert motion.shape == (1, frames, FEATURES)
        assert torch.isfinite(motion).all()
