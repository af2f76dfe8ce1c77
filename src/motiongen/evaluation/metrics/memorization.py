"""Whether generated clips are copies of training clips."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.evaluation.metrics.pairwise import distance_blocks, require_sets


def nearest_training_distance(features: Tensor, training: Tensor) -> Tensor:
    """Distance of every clip to the nearest training clip.

    features (N, E) and training (M, E) to (N,) float64: min over training rows of |x - y|. Unit: feature units. Range 0
    to infinity; 0 is a copy. Best near the distances of real test clips: far below them the generator repeats its
    training clips, far above them it is off the data. Features forget much of a motion, so a small distance is a reason
    to look at the two clips. Source: the search for nearest neighbours in the training set that Theis et al. 2016 (A
    note on the evaluation of generative models) discuss, with its limits.

    Raises:
        ValueError: no clips, no training clips, or sets of different widths.
    """
    require_sets("the nearest training distance", features, training, least=1)
    nearest = torch.cat([block.argmin(dim=1) for block in distance_blocks(features, training, exact=False)])
    # From the coordinates again, so that a copy is at zero.
    return (features.double() - training.double()[nearest]).norm(dim=1)
