"""All metrics of one set of motions, from what was measured on its clips."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from motiongen.evaluation.judgement import Judgement
from motiongen.evaluation.metrics.classification import balanced_accuracy, hits, inception_score, top_k_accuracy
from motiongen.evaluation.metrics.coverage import density_coverage, precision_recall
from motiongen.evaluation.metrics.frechet import extrapolated_frechet_distance, frechet_distance
from motiongen.evaluation.metrics.kernel import kernel_distance
from motiongen.evaluation.metrics.memorization import nearest_training_distance
from motiongen.evaluation.metrics.spread import diversity, expected_diversity, expected_multimodality, multimodality

if TYPE_CHECKING:
    from motiongen.evaluation.protocol import Protocol

TOP = 5


def metrics(judged: Judgement, reference: Tensor, training: Tensor, seed: int, protocol: Protocol) -> dict[str, float]:
    """All metrics of one set of motions; NaN for what such a set cannot be asked.

    Pairs are drawn from `seed` alone, so all systems are measured on the same ones. Motion quantities are means over
    clips, each clip counting once however long it is; jerk is the largest of all clips.

    Args:
        judged: the motions.
        reference: (M, E) the features that they are compared with.
        training: (L, E) the features of all training clips.
        seed: of what is drawn.
        protocol: settings.
    """
    generator = torch.Generator().manual_seed(seed)
    return {
        **_recognition(judged),
        "fid": frechet_distance(judged.features, reference),
        "endless_fid": endless_frechet_distance(judged.features, reference, torch.Generator().manual_seed(seed)),
        "kid": kernel_distance(judged.features, reference),
        **_neighbourhoods(reference, judged.features, protocol),
        "diversity": diversity(judged.features, generator, protocol.diversity_pairs),
        "multimodality": multimodality(judged.features, judged.tags, generator, protocol.multimodality_pairs),
        "expected_diversity": expected_diversity(judged.features),
        "expected_multimodality": expected_multimodality(judged.features, judged.tags),
        "nearest_training_distance": float(nearest_training_distance(judged.features, training).mean()),
        "peak_jerk": float(judged.peak_jerk.nan_to_num(0.0).max()),
        **{name: float(values.nanmean()) for name, values in clip_values(judged).items()},
    }


def clip_values(judged: Judgement) -> dict[str, Tensor]:
    """The metrics that are means over clips, before the mean: name to (N,) float64, NaN where a clip has no value."""
    return {
        "accuracy": hits(judged.logits, judged.tags).double(),
        "trajectory_error": judged.trajectory_error,
        "joint_position_error": judged.joint_position_error,
        "joint_speed": judged.joint_speed,
        "frozen_share": judged.frozen_share,
        "foot_skating": judged.foot_skating,
        "floor_penetration": judged.floor_penetration,
        "mean_jerk": judged.mean_jerk,
        "jerk_area": judged.jerk_area,
    }


def endless_frechet_distance(features: Tensor, reference: Tensor, generator: torch.Generator) -> float:
    """The FID extrapolated to infinitely many motions (N, E); NaN for N below 2 E, where its bias is no line in 1/N."""
    if len(features) < 2 * features.shape[1]:
        return math.nan
    return extrapolated_frechet_distance(features, reference, generator, smallest=0.5)


def _recognition(judged: Judgement) -> dict[str, float]:
    return {
        "top5_accuracy": top_k_accuracy(judged.logits, judged.tags, min(TOP, judged.logits.shape[1])),
        "balanced_accuracy": balanced_accuracy(judged.logits, judged.tags),
        "inception_score": inception_score(judged.logits),
    }


def _neighbourhoods(real: Tensor, generated: Tensor, protocol: Protocol) -> dict[str, float]:
    """Precision, recall, density and coverage; NaN where a set has no such neighbours."""
    names = ("precision", "recall", "density", "coverage")
    if min(len(real), len(generated)) <= max(protocol.manifold_neighbours, protocol.coverage_neighbours):
        return dict.fromkeys(names, math.nan)
    values = (
        *precision_recall(real, generated, protocol.manifold_neighbours),
        *density_coverage(real, generated, protocol.coverage_neighbours),
    )
    return dict(zip(names, values, strict=True))
