"""`task=compositions`: every encoder with every conditioning, unroller, decoder and training scheme, at scale=smoke.

Each composition takes three training steps on random data and generates, or it is refused with a reason. No data set is
needed. An unroller that takes a query gets the sum of all query mechanisms; other lists stay empty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

import roma
import torch
from hydra.utils import instantiate
from omegaconf import DictConfig
from tqdm import tqdm

from motiongen.configuration import compose
from motiongen.contracts import Condition, GeneratorModule, MotionBatch
from motiongen.data.clips import INITIAL_FRAMES
from motiongen.discovery import options
from motiongen.errors import input_error
from motiongen.evaluation.table import markdown
from motiongen.motion.bodies import makehuman
from motiongen.motion.representation import FEATURES, pack
from motiongen.motion.skeleton import JOINTS, Skeleton
from motiongen.objectives.objective import Objective

SLOTS = ("encoder", "conditioning", "unroller", "decoder", "training")
BASE = ("scale=smoke", "generator=staged", "objective=reconstruction")
QUERY = "generator/unroller/query"
TAGS = 3
LENGTHS = (12, 7, 9)
STEPS = 3
RUNS, REFUSED, FAILS = "runs", "refused", "fails"


@dataclass(frozen=True)
class Trial:
    """What became of one composition."""

    choice: tuple[str, ...]
    """The option of every slot, in the order of SLOTS."""
    outcome: str
    """RUNS, REFUSED by a CompositionError, or FAILS: an error that nobody foresaw."""
    reason: str = ""


def run(config: DictConfig) -> None:
    """Print the table; the configuration does not matter. Exits with 1 if a composition fails without being refused."""
    torch.set_num_threads(1)  # such small tensors are slower on several
    trials = [trial(choice) for choice in tqdm(choices(), desc="compositions", unit="")]
    print(report(trials))
    if any(one.outcome == FAILS for one in trials):
        raise SystemExit(1)


def choices() -> list[tuple[str, ...]]:
    """The cross product of the options of all slots."""
    return list(product(*(option_names(f"generator/{slot}") for slot in SLOTS)))


def option_names(group: str) -> list[str]:
    return [option.name for option in options() if option.group == group]


def trial(choice: tuple[str, ...]) -> Trial:
    """Build a composition, train it for some steps and let it generate."""
    try:
        train_and_generate(build(choice))
    except Exception as error:  # whatever a plugin may raise belongs into the table
        refusal = input_error(error)
        if refusal is not None:
            return Trial(choice, REFUSED, str(refusal))
        return Trial(choice, FAILS, f"{type(error).__name__}: {error}")
    return Trial(choice, RUNS)


def build(choice: tuple[str, ...]) -> GeneratorModule:
    """A generator of the chosen stages.

    Raises:
        CompositionError: they do not go together.
    """
    torch.manual_seed(0)
    stages = {slot: stage(slot, name) for slot, name in zip(SLOTS, choice, strict=True)}
    generator: GeneratorModule = _instance("generator")(
        features=FEATURES, tags=TAGS, initial_frames=INITIAL_FRAMES, **stages
    )
    return generator


@cache
def stage(slot: str, name: str) -> Any:
    """The builder of a stage (the scheme itself for `training`) with the lists that it takes."""
    chosen = [*BASE, f"generator/{slot}={name}"]
    node = compose(chosen).generator[slot]
    if "query" in node:
        node = compose([*chosen, f"{QUERY}=[{','.join(option_names(QUERY))}]"]).generator[slot]
    return instantiate(node)


@cache
def _instance(section: str) -> Any:
    return instantiate(compose(BASE)[section])


def train_and_generate(generator: GeneratorModule) -> None:
    """Some steps from the start to the end of a run, what follows training, and a motion.

    Raises:
        FloatingPointError: loss or motion are not finite.
    """
    objective: Objective = _instance("objective")
    batch, skeleton, draws = random_batch(), _skeleton(), torch.Generator().manual_seed(0)
    optimizer = torch.optim.Adam(generator.parameters(), lr=1e-3)
    for step in range(STEPS):
        progress = step / (STEPS - 1)
        prediction = generator.reconstruct(batch, progress, draws)
        loss = objective.total(objective.terms(prediction, batch, skeleton), progress)
        if not loss.isfinite():
            raise FloatingPointError(f"the loss of step {step + 1} is {loss.item()}")
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    generator.eval().conclude([batch])
    if not generator.generate(batch.condition, seed=0).isfinite().all():
        raise FloatingPointError("the generated motion is not finite")


@cache
def _skeleton() -> Skeleton:
    return makehuman().skeleton


def random_batch() -> MotionBatch:
    """Random poses and a condition, padded to the longest of LENGTHS, one action a row."""
    draws = torch.Generator().manual_seed(0)
    rows, frames = len(LENGTHS), max(LENGTHS)
    turns = 0.5 * torch.randn(rows, INITIAL_FRAMES + frames, JOINTS, 3, generator=draws)
    clips = pack(roma.rotvec_to_rotmat(turns), torch.randn(rows, INITIAL_FRAMES + frames, 3, generator=draws))
    initial, motion = clips[:, :INITIAL_FRAMES], clips[:, INITIAL_FRAMES:]
    mask = torch.arange(frames) < torch.tensor(LENGTHS).unsqueeze(1)
    motion = motion * mask.unsqueeze(-1)
    tags = torch.eye(TAGS)[torch.arange(rows) % TAGS]
    styles = torch.zeros(rows, 0)
    return MotionBatch(motion, Condition(tags, tags.roll(1, dims=0), initial, motion[..., -3:-1], mask, styles))


def report(trials: Sequence[Trial]) -> str:
    """The table, one column for every training scheme; every reason once; the counts."""
    numbers = {reason: number for number, reason in enumerate(dict.fromkeys(t.reason for t in trials if t.reason), 1)}
    rows: dict[tuple[str, ...], dict[str, str]] = {}
    for one in trials:
        *stages, training = one.choice
        row = rows.setdefault(tuple(stages), dict(zip(SLOTS, stages, strict=False)))
        row[training] = f"{one.outcome} [{numbers[one.reason]}]" if one.reason else one.outcome
    counts = {outcome: sum(one.outcome == outcome for one in trials) for outcome in (RUNS, REFUSED, FAILS)}
    return "\n".join(
        [
            markdown(list(rows.values())),
            "",
            *(f"[{number}] {reason}" for reason, number in numbers.items()),
            "",
            f"{len(trials)} compositions: {counts[RUNS]} run, {counts[REFUSED]} are refused, {counts[FAILS]} fail",
        ]
    )
