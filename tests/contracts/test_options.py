"""What every registered option of every generator slot has to do, whoever wrote it.

Each option is put into the first experiment that it goes with; where it goes with none as they are, into one with
another decoder, training scheme or unroller. An experiment is tried as it is. Everything runs at scale=smoke.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import product
from types import SimpleNamespace

import pytest
import torch
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from motiongen.configuration import ConfigurationError, compose
from motiongen.contracts import GeneratorModule, MotionBatch
from motiongen.discovery import Option, options
from motiongen.errors import input_error
from motiongen.generation.checkpoint import load_generator, save_generator
from motiongen.objectives.objective import Objective
from motiongen.options_check import problems_in
from motiongen.tasks.assembly import build_generator
from tests.compositions import STYLES, TAGS, batch, cannot_be_reached, skeleton

LISTS = ("generator/unroller/query", "generator/unroller/branches", "generator/decoder/layer_input")
NAMES = tuple(f"tag {number}" for number in range(TAGS))
VOCABULARY = SimpleNamespace(tags=NAMES, styles=tuple(f"style {number}" for number in range(STYLES)))
"""All that a generator has to know of the data."""
TOLERANCE = {"atol": 2e-5, "rtol": 2e-5}


def of(group: str) -> list[str]:
    return [option.name for option in options() if option.group == group]


@cache
def composed(overrides: tuple[str, ...]) -> DictConfig | None:
    """The configuration, or None where the command line would refuse it before anything is built."""
    try:
        config = compose(["scale=smoke", *overrides])
    except ConfigurationError:
        return None
    return None if problems_in(config, ("generator", "objective", "optimizer")) else config


@cache
def experiments() -> dict[str, DictConfig]:
    """Those that train a generator."""
    found = {name: compose([f"+experiment={name}", "scale=smoke"]) for name in of("experiment")}
    return {name: config for name, config in found.items() if config.task.name == "train"}


def generator_of(config: DictConfig, seed: int = 0) -> GeneratorModule:
    return build_generator(OmegaConf.merge(config, {"seed": seed}), VOCABULARY)


def candidates(option: Option) -> Iterator[tuple[str, ...]]:
    """Command lines that might use the option, the most natural first."""
    if option.group == "experiment":
        yield (f"+experiment={option.name}",)
        return
    for name, config in experiments().items():
        yield f"+experiment={name}", f"{option.group}={chosen(option, config)}"
    slots = [slot for slot in ("generator/training", "generator/decoder", "generator/unroller") if slot != option.group]
    emptied = [f"{group}=[]" for group in LISTS if group != option.group]
    for others in product(*(of(slot) for slot in slots)):
        replaced = [f"{slot}={other}" for slot, other in zip(slots, others, strict=True)]
        for name in experiments():
            yield f"+experiment={name}", *replaced, *emptied, f"{option.group}={chosen(option, experiments()[name])}"


def chosen(option: Option, config: DictConfig) -> str:
    """The option, in a list slot behind what the experiment has there."""
    if option.group not in LISTS:
        return option.name
    slot, _, part = option.group.removeprefix("generator/").partition("/")
    own = (config.generator.get(slot) or {}).get(part) or {}
    return f"[{','.join([*(name for name in own if name != option.name), option.name])}]"


@cache
def home(option: Option) -> DictConfig:
    """The composition in which the option is tried."""
    for overrides in candidates(option):
        config = composed(overrides)
        if config is None:
            continue
        try:
            generator_of(config)
        except Exception as error:
            if input_error(error) is None:
                raise
            continue
        return config
    pytest.fail(f"no composition uses {option.group}={option.name}")


TRIED = [
    option
    for option in options()
    if option.group.split("/")[0] == "generator" or (option.group == "experiment" and option.name in experiments())
]
every_option = pytest.mark.parametrize("option", TRIED, ids=lambda option: f"{option.group}={option.name}")


def data(*lengths: int, frames: int | None = None) -> MotionBatch:
    return batch(lengths or (9, 5, 12, 7, 8), frames)


def draws() -> torch.Generator:
    return torch.Generator().manual_seed(7)


def trained(config: DictConfig, seed: int = 0) -> GeneratorModule:
    """A generator after what follows training, ready for use."""
    generator = generator_of(config, seed).eval()
    generator.conclude([data()])
    return generator


def loss(config: DictConfig, generator: GeneratorModule, progress: float) -> torch.Tensor:
    objective: Objective = instantiate(config.objective)
    torch.manual_seed(0)  # dropout
    prediction = generator.reconstruct(data(), progress, draws())
    assert prediction.motion.shape == data().motion.shape
    return objective.total(objective.terms(prediction, data(), skeleton()), progress)


@every_option
def test_gradients_reach_every_parameter(option: Option) -> None:
    """At some point of the run at least: schedules may leave parts out at others."""
    config = home(option)
    generator = generator_of(config).train()
    for progress in (0.0, 0.5, 1.0):
        loss(config, generator, progress).backward()
    gradients = {name: parameter.grad for name, parameter in generator.named_parameters() if parameter.requires_grad}
    missing = {name for name, gradient in gradients.items() if gradient is None or not gradient.any()}
    assert missing <= cannot_be_reached(generator)
    assert all(gradient.isfinite().all() for gradient in gradients.values())


@every_option
def test_padding_changes_no_valid_frame(option: Option) -> None:
    generator = trained(home(option))
    tight, loose, mask = data(9, 5), data(9, 5, frames=20), data(9, 5).condition.mask
    hole = ~loose.condition.mask.unsqueeze(-1)
    path = loose.condition.trajectory + 100 * hole
    dirty = MotionBatch(loose.motion + 100 * hole, replace(loose.condition, trajectory=path))
    with torch.no_grad():
        for progress in (0.0, 1.0):
            expected = generator.reconstruct(tight, progress, draws()).motion[mask]
            for padded in (loose, dirty):
                found = generator.reconstruct(padded, progress, draws()).motion[:, :9][mask]
                torch.testing.assert_close(found, expected, **TOLERANCE)
    short, long = generator.generate(tight.condition, seed=1), generator.generate(loose.condition, seed=1)
    torch.testing.assert_close(long[:, :9], short, **TOLERANCE)
    assert (long[:, 9:] == 0).all()


@every_option
def test_the_seed_decides(option: Option) -> None:
    generator, condition = trained(home(option)), data().condition
    motion = generator.generate(condition, seed=1)
    assert torch.equal(generator.generate(condition, seed=1), motion)
    assert not torch.equal(generator.generate(condition, seed=2), motion)
    with torch.no_grad():
        first, again = (generator.reconstruct(data(), 0.5, draws()).motion for _ in range(2))
    assert torch.equal(first, again)


@every_option
def test_saved_and_loaded_it_generates_the_same(option: Option, tmp_path) -> None:
    generator, other = trained(home(option)), generator_of(home(option), seed=1)
    save_generator(tmp_path / "generator.pt", generator, NAMES, ())
    load_generator(tmp_path / "generator.pt", other, NAMES)
    condition = data().condition
    assert torch.equal(other.generate(condition, seed=3), generator.generate(condition, seed=3))


@every_option
def test_generates_every_length(option: Option) -> None:
    generator = trained(home(option))
    for lengths in ((1,), (20, 60, 200)):
        condition = data(*lengths).condition
        motion = generator.generate(condition, seed=0)
        assert motion.shape == (len(lengths), max(lengths), 135)
        assert motion.isfinite().all()
        assert motion[condition.mask].any(dim=-1).all()


@every_option
def test_runs_in_bfloat16(option: Option) -> None:
    config = home(option)
    generator = trained(config)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        value = loss(config, generator, 1.0)
        motion = generator.generate(data().condition, seed=0)
    value.backward()
    assert motion.isfinite().all()
    assert all(p.grad is None or p.grad.isfinite().all() for p in generator.parameters())


@pytest.mark.parametrize("name", of("objective"))
def test_every_objective_trains_some_generator(name: str) -> None:
    failures = []
    for experiment in experiments():
        config = composed((f"+experiment={experiment}", f"objective={name}"))
        assert config is not None
        try:
            value = loss(config, generator_of(config), 0.5)
        except ValueError as error:  # terms that this generator does not give
            failures.append(str(error))
            continue
        value.backward()
        return
    pytest.fail("; ".join(failures))


@pytest.mark.parametrize("name", of("optimizer"))
def test_every_optimizer_takes_a_step(name: str) -> None:
    experiment = next(iter(experiments()))
    config = composed((f"+experiment={experiment}", f"optimizer={name}"))
    assert config is not None
    generator = generator_of(config)
    optimizer = instantiate(config.optimizer).optimizer(generator.parameters())
    before = loss(config, generator, 0.5)
    for _ in range(3):
        optimizer.zero_grad()
        loss(config, generator, 0.5).backward()
        optimizer.step()
    assert loss(config, generator, 0.5) < before
