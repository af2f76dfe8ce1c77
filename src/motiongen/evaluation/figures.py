"""All metrics of one set of motions, from what was measured on its clips."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from motiongen.evaluation.judgement import Judgement
from motiongen.evaluation.metrics.classification import accuracy, balanced_accuracy, inception_score, top_k_accuracy
from motiongen.evaluation.metrics.coverage import density_coverage, precision_recall
from motiongen.evaluation.metrics.frechet import frechet_distance
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
        "kid": kernel_distance(judged.features, reference),
        **_neighbourhoods(reference, judged.features, protocol),
        "diversity": diversity(judged.features, generator, protocol.diversity_pairs),
        "multimodality": multimodality(judged.features, judged.tags, generator, protocol.multimodality_pairs),
        "expected_diversity": expected_diversity(judged.features),
        "expected_multimodality": expected_multimodality(judged.features, judged.tags),
        "nearest_training_distance": float(nearest_training_distance(judged.features, training).mean()),
        "trajectory_error": float(judged.trajectory_error.nanmean()),
        "joint_position_error": float(judged.joint_position_error.mean()),
        "joint_speed": float(judged.joint_speed.nanmean()),
        "frozen_share": float(judged.frozen_share.nanmean()),
        "foot_skating": float(judged.foot_skating.nanmean()),
        "floor_penetration": float(judged.floor_penetration.nanmean()),
        "peak_jerk": float(judged.peak_jerk.nan_to_num(0.0).max()),
        "mean_jerk": float(judged.mean_jerk.nanmean()),
    }


def _recognition(judged: Judgement) -> dict[str, float]:
    return {
        "accuracy": accuracy(judged.logits, judged.tags),
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
