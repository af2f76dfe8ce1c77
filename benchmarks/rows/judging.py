"""Judging motions: metrics on features, and the recognizer's part.

Reference: scipy's matrix root; pairs of clips one after another; a recognizer that runs twice over every motion, for
the accuracy and for the features, as in the public scripts, from joints that are posed one by one. Both use the default
recognizer with first weights.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import torch
from torch import Tensor

from benchmarks.measuring import Effort, interleaved
from benchmarks.reference import judging as plain
from benchmarks.results import Comparison, Figure, Result
from benchmarks.subjects import TAGS, body, motion_batch
from motiongen.contracts import MotionBatch
from motiongen.evaluation.judgement import Judge
from motiongen.evaluation.metrics.coverage import density_coverage, precision_recall
from motiongen.evaluation.metrics.frechet import frechet_distance
from motiongen.evaluation.metrics.kernel import kernel_distance
from motiongen.evaluation.metrics.memorization import nearest_training_distance
from motiongen.evaluation.metrics.spread import diversity, expected_diversity, multimodality
from motiongen.recognition.recognizer import Recognizer
from motiongen.recognition.transformer import TransformerRecognizer

TITLE = "Judging"
WIDTH = 256
PAIRS, PAIRS_OF_AN_ACTION = 200, 20


def measure(effort: Effort) -> list[Result]:
    return [_fid(effort), *_spread(effort), _recognition(effort), *_parts(1000, effort), *_parts(10000, effort)]


def _features(count: int, width: int, seed: int) -> Tensor:
    return torch.randn(count, width, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def _compared(name: str, ways: dict, effort: Effort, tolerance: float, target: float | None) -> Comparison:
    """Ways that return one number, which has to be the same."""
    slow, fast = ways["reference"](), ways["ours"]()
    return Comparison(name, **interleaved(ways, effort), error=abs(fast / slow - 1), tolerance=tolerance, target=target)


def _fid(effort: Effort) -> Comparison:
    width = effort.size(WIDTH, 8)
    sets = [_features(effort.size(1000, 40), width, seed) + seed for seed in (0, 1)]
    ways = {"reference": partial(plain.frechet_distance, *sets), "ours": partial(frechet_distance, *sets)}
    return _compared(f"FID, {width} features", ways, effort, 1e-9, 3.5)


def _spread(effort: Effort) -> list[Comparison]:
    count = effort.size(10000, 200)
    features, labels = _features(count, effort.size(WIDTH, 8), 0), torch.arange(count) % TAGS
    tags = torch.eye(TAGS)[labels]

    def by_draws() -> float:
        pairs = torch.randint(count, (2, PAIRS), generator=torch.Generator().manual_seed(0))
        spread = plain.multimodality(features, labels, np.random.default_rng(0), PAIRS_OF_AN_ACTION)
        return plain.diversity(features, pairs) + spread

    def ours() -> float:
        draws = torch.Generator().manual_seed(0)
        found = diversity(features, draws, PAIRS)
        return found + multimodality(features, tags, draws, PAIRS_OF_AN_ACTION)

    draws = {"reference": by_draws, "ours": ours}
    # Of 10,000 motions the reference would need minutes.
    fewer = features[: count // 5]
    pairs = {"reference": partial(plain.mean_distance, fewer), "ours": partial(expected_diversity, fewer)}
    return [
        # The pairs within an action are other draws, so the sums differ by chance.
        _compared(f"diversity and multimodality, {count} motions, drawn pairs", draws, effort, 0.1, 50.0),
        _compared(f"diversity, {len(fewer)} motions, all pairs", pairs, effort, 1e-9, 50.0),
    ]


def _recognition(effort: Effort) -> Comparison:
    torch.manual_seed(0)
    network = TransformerRecognizer(tags=TAGS, skeleton=body(1).skeleton).eval()
    size = effort.size(50, 2)
    batches = [motion_batch([effort.size(60, 5)] * size, seed=seed) for seed in range(effort.size(20, 2))]
    ways = {"reference": partial(_twice, network, batches), "ours": partial(_once, network, batches)}
    return _compared(f"recognizer and FID, {size * len(batches)} motions twice", ways, effort, 1e-6, 5.0)


def _recognized(network: TransformerRecognizer, batches: list[MotionBatch], field: str) -> Tensor:
    found = []
    for batch in batches:
        mask = batch.condition.mask
        signals = plain.body_signals(batch.motion, mask, body(1).rest_joints)
        found.append(getattr(network.recognize(signals, mask), field))
    return torch.cat(found).double()


@torch.no_grad()
def _twice(network: TransformerRecognizer, batches: list[MotionBatch]) -> float:
    """Generated and real motions, each for the accuracy and then for the features."""
    result = 0.0
    features = []
    for part in (batches[::2], batches[1::2]):
        labels = torch.cat([batch.condition.tags for batch in part])
        guesses = _recognized(network, part, "logits").argmax(dim=1)
        result += float((guesses == labels.argmax(dim=1)).double().mean())
        features.append(_recognized(network, part, "features"))
    return result + plain.frechet_distance(*features)


@torch.inference_mode()
def _once(network: Recognizer, batches: list[MotionBatch]) -> float:
    result = 0.0
    features = []
    for part in (batches[::2], batches[1::2]):
        seen = [network(batch.motion, batch.condition.mask) for batch in part]
        labels = torch.cat([batch.condition.tags for batch in part])
        result += float((torch.cat([one.logits for one in seen]).argmax(1) == labels.argmax(1)).double().mean())
        features.append(torch.cat([one.features for one in seen]))
    return result + frechet_distance(*features)


def _parts(count: int, effort: Effort) -> list[Figure]:
    """Where the time of an evaluation of so many motions of 60 frames goes."""
    torch.manual_seed(0)
    count, width = effort.size(count, count // 20), 64
    skeleton = body(1).skeleton
    network = TransformerRecognizer(tags=TAGS, skeleton=skeleton, feature_width=width).eval()
    judge = Judge(network, skeleton, torch.ones(TAGS, dtype=torch.bool), torch.zeros(4), 0.1, 100.0)
    batch = motion_batch([effort.size(60, 5)] * effort.size(50, 4))
    features, real = _features(count, width, 0), _features(count, width, 1)
    parts = {
        "recognizer": lambda: torch.inference_mode()(network)(batch.motion, batch.condition.mask),
        "recognizer, kinematics, speed, skating, jerk": lambda: judge(batch.motion, batch),
        "FID": lambda: frechet_distance(features, real),
        "KID": lambda: kernel_distance(features, real),
        "precision, recall": lambda: precision_recall(real, features, 3),
        "density, coverage": lambda: density_coverage(real, features, 5),
        "nearest training clip": lambda: nearest_training_distance(features, real),
    }
    rounds = {name: count / len(batch.motion) if name.startswith("recognizer") else 1 for name in parts}
    taken = interleaved(parts, effort)
    return [
        Figure(f"{name}, {count} motions", 1000 * rounds[name] * timing.median, "ms") for name, timing in taken.items()
    ]
