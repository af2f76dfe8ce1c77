"""The one protocol through which every figure passes: which clips, which seeds, which recognizer, which settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import torch
from rich.progress import Progress
from torch import Tensor

from motiongen.contracts import Condition
from motiongen.evaluation.figures import metrics
from motiongen.evaluation.judgement import Judge, Judgement
from motiongen.evaluation.leaks import refuse_leaks
from motiongen.evaluation.metrics.classification import class_accuracy
from motiongen.evaluation.results import REAL, ActionResult, Evaluation, SystemResult
from motiongen.options import NonNegativeFloat, PositiveInt, Share
from motiongen.recognition.recognizer import Recognizer, TrainedRecognizer

if TYPE_CHECKING:
    from motiongen.data.datamodule import MotionData

Generate = Callable[[Condition, int], Tensor]
"""Condition and seed to motion (B, T, 135): all that evaluation knows of a system."""


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """How a system is judged. Results compare only when their protocols are equal."""

    seeds: PositiveInt = 5
    """How many times every test clip is generated; the intervals are over these."""
    first_seed: int = 0
    """The seeds are first_seed, first_seed + 1, ..."""
    batch_size: PositiveInt = 64
    """Motions generated at once. Part of the protocol, as a generator's noise may depend on the batch."""
    diversity_pairs: PositiveInt = 200
    """S_d of Action2Motion."""
    multimodality_pairs: PositiveInt = 20
    """S_l of Action2Motion."""
    speed_tolerance: Share = 0.3
    """An action's mean joint speed may differ from the real clips' by this share of it."""
    frozen_speed: NonNegativeFloat = 0.05
    """Metres per second: below this mean joint speed a body counts as frozen."""
    manifold_neighbours: PositiveInt = 3
    """k of precision and recall (Kynkäänniemi et al. 2019)."""
    coverage_neighbours: PositiveInt = 5
    """k of density and coverage (Naeem et al. 2020)."""

    @property
    def generation_seeds(self) -> range:
        """The seeds themselves."""
        return range(self.first_seed, self.first_seed + self.seeds)


@torch.inference_mode()
def evaluate(
    systems: Mapping[str, Generate], data: MotionData, recognizer: TrainedRecognizer, protocol: Protocol
) -> Evaluation:
    """Judge systems, and the real clips, on the test split.

    Every system generates every test clip once a seed. A system's FID is against the real test clips; the real clips'
    own FID is against as many training clips, drawn anew for every seed. All other metrics of the real clips are the
    same functions on the real motion.

    Args:
        systems: name to system, for example {"generated": model.generate}; the model is in eval mode and on the
            recognizer's device.
        data: whose test split is used.
        recognizer: trained on the same data's training split.
        protocol: seeds and settings.

    Raises:
        LeakError: a test clip lies in the training set.
        ValueError: a system named "real", or one whose motion is not finite or of the wrong shape (with its name).
    """
    if REAL in systems:
        raise ValueError(f'the name "{REAL}" is kept for the real test clips')
    refuse_leaks(data)
    network = recognizer.recognizer.eval()
    device = next(network.parameters()).device
    batches = [batch.to(device) for batch in data.test_batches(protocol.batch_size)]
    judge = Judge.of(network, data, batches, protocol.frozen_speed)
    real = Judgement.concatenate(judge(batch.motion, batch) for batch in batches)
    training = _training_features(network, data, protocol.batch_size, device)
    drawn = min(len(real), len(training))
    own = []
    for seed in protocol.generation_seeds:
        chosen = torch.randperm(len(training), generator=_generator(seed))[:drawn]
        own.append(metrics(real, training[chosen], training, seed, protocol))
    results = {REAL: SystemResult(values=_by_metric(own), actions=action_results(real, real, data.tags))}
    with Progress() as progress:
        task = progress.add_task("Evaluating", total=len(systems) * protocol.seeds * len(batches))
        for name, generate in systems.items():
            runs = []
            for seed in protocol.generation_seeds:
                judgements = []
                for index, batch in enumerate(batches):
                    # Neither batches nor seeds may share their noise: every pair of the two has a number of its own.
                    motion = generate(batch.condition, seed * len(batches) + index)
                    try:
                        judgements.append(judge(motion, batch))
                    except ValueError as error:
                        raise ValueError(f"system {name}, seed {seed}: {error}") from error
                    progress.advance(task)
                runs.append(Judgement.concatenate(judgements))
            seeds = zip(runs, protocol.generation_seeds, strict=True)
            values = [metrics(run, real.features, training, seed, protocol) for run, seed in seeds]
            actions = action_results(Judgement.concatenate(runs), real, data.tags)
            results[name] = SystemResult(values=_by_metric(values), actions=actions)
    return Evaluation(
        protocol=protocol,
        systems=results,
        count=len(real),
        real_fid_count=drawn,
        data_fingerprint=data.fingerprint,
        recognizer_fingerprint=recognizer.fingerprint,
        recognizer_accuracy=recognizer.test_accuracy,
    )


def action_results(judged: Judgement, real: Judgement, tags: tuple[str, ...]) -> dict[str, ActionResult]:
    """What the clips of every tag scored, beside the real clips of that tag; tags without a test clip are left out."""
    right = class_accuracy(judged.logits, judged.tags)
    speed, real_speed = _tag_means(judged.joint_speed, judged.tags), _tag_means(real.joint_speed, real.tags)
    skating, real_skating = _tag_means(judged.foot_skating, judged.tags), _tag_means(real.foot_skating, real.tags)
    counts = (real.tags > 0).sum(dim=0)
    return {
        tag: ActionResult(
            count=int(counts[column]),
            accuracy=float(right[column]),
            joint_speed=float(speed[column]),
            speed_ratio=float(speed[column] / real_speed[column]),
            foot_skating=float(skating[column]),
            skating_ratio=float(skating[column] / real_skating[column]),
        )
        for column, tag in enumerate(tags)
        if counts[column]
    }


def _tag_means(values: Tensor, tags: Tensor) -> Tensor:
    """Mean of (N,) over the clips of every tag (N, A), NaN clips left out: (A,)."""
    return torch.stack([values[column > 0].nanmean() for column in tags.T])


def _by_metric(seeds: list[dict[str, float]]) -> dict[str, tuple[float, ...]]:
    return {metric: tuple(values[metric] for values in seeds) for metric in seeds[0]}


def _training_features(network: Recognizer, data: MotionData, batch_size: int, device: torch.device) -> Tensor:
    """(M, E) float64 features of all training clips, cut into windows as the test clips are."""
    batches = (batch.to(device) for batch in data.train_windows(batch_size))
    return torch.cat([network(batch.motion, batch.condition.mask).features for batch in batches]).double().cpu()


def _generator(seed: int) -> torch.Generator:
    return torch.Generator().manual_seed(seed)
