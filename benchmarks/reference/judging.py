"""Metrics as the evaluation scripts of Action2Motion and ACTOR have them."""

from __future__ import annotations

import numpy as np
import scipy.linalg
import torch
import torch.nn.functional as F
from torch import Tensor

from benchmarks.reference.kinematics import posed_joints, rotation_from_6d
from motiongen.motion.skeleton import JOINTS


def frechet_distance(first: Tensor, second: Tensor) -> float:
    """FID by scipy's root of the product of the covariances."""
    one, other = first.numpy(), second.numpy()
    apart = one.mean(axis=0) - other.mean(axis=0)
    covariance, other_covariance = np.cov(one, rowvar=False), np.cov(other, rowvar=False)
    root = scipy.linalg.sqrtm(covariance.dot(other_covariance))
    return float(apart.dot(apart) + np.trace(covariance) + np.trace(other_covariance) - 2 * np.trace(root.real))


def body_signals(motion: Tensor, mask: Tensor, rest_joints: Tensor, fps: float = 30.0) -> Tensor:
    """Motion (B, T, 135) to what a recognizer sees (B, T, SIGNALS); the body is posed joint by joint."""
    rotations = rotation_from_6d(motion[..., :-3].reshape(-1, JOINTS, 6))
    relative = posed_joints(rotations, rest_joints).view(*mask.shape, JOINTS, 3)
    position = motion[..., None, -3:]
    velocity = F.pad((relative + position).diff(dim=1), (0, 0, 0, 0, 1, 0)) * fps
    frame = torch.cat([relative[..., 1:, :].flatten(2), motion[..., -1:], velocity.flatten(2)], dim=-1)
    return frame * mask.unsqueeze(-1)


def mean_distance(features: Tensor) -> float:
    """Mean distance over all ordered pairs of clips, pair after pair of rows."""
    total = 0.0
    for one in features:
        total += float(torch.norm(features - one, dim=1).sum())
    return total / len(features) ** 2


def diversity(features: Tensor, pairs: Tensor) -> float:
    """Mean distance of the clips that (2, P) indices pair, one `torch.dist` after another."""
    total = 0.0
    for one, other in pairs.T.tolist():
        total += float(torch.dist(features[one], features[other]))
    return total / pairs.shape[1]


def multimodality(features: Tensor, labels: Tensor, rng: np.random.Generator, pairs: int) -> float:
    """Clips are drawn until every action has had its pairs."""
    quotas = np.repeat(pairs, int(labels.max()) + 1)
    total = 0.0
    while np.any(quotas > 0):
        one = int(rng.integers(len(labels)))
        label = int(labels[one])
        if not quotas[label]:
            continue
        other = int(rng.integers(len(labels)))
        while int(labels[other]) != label:
            other = int(rng.integers(len(labels)))
        quotas[label] -= 1
        total += float(torch.dist(features[one], features[other]))
    return total / (pairs * (int(labels.max()) + 1))
