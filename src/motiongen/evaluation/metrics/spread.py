"""How far apart the clips of one set are, in recognizer features."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.evaluation.metrics.pairwise import distance_blocks


def diversity(features: Tensor, generator: torch.Generator, pairs: int = 200) -> float:
    """Mean distance between randomly paired clips (N, E) of any action.

    `pairs` pairs are drawn with replacement, as in the code of Action2Motion (Guo et al. 2020, section 5.1, S_d = 200).
    Neural Marionette (section 5.1.2) pairs the two halves of the set, which has the same expectation but for the pairs
    of a clip with itself. Unit: feature units. Range 0 to infinity; best near the value of real clips.

    Raises:
        ValueError: fewer than two clips.
    """
    _require_clips(features)
    return float(_distances(features, torch.randint(len(features), (2, pairs), generator=generator)).mean())


def expected_diversity(features: Tensor) -> float:
    """What `diversity` is on average: the mean distance over all N^2 ordered pairs of clips (N, E).

    Pairs of a clip with itself count, as `diversity` draws them too; without them the value is N / (N - 1) times as
    large. Nothing is drawn, so nothing varies, and memory does not grow with N^2. Unit: feature units. Range 0 to
    infinity; best near the value of real clips. Source: the expectation of Guo et al. 2020, section 5.1.

    Raises:
        ValueError: fewer than two clips.
    """
    _require_clips(features)
    return float(_mean_distance(features))


def multimodality(features: Tensor, tags: Tensor, generator: torch.Generator, pairs: int = 20) -> float:
    """Mean distance between randomly paired clips of the same action, then the mean over actions.

    features (N, E), multi-hot tags (N, A). `pairs` pairs an action are drawn with replacement (Action2Motion, section
    5.1, S_l = 20; Neural Marionette, section 5.1.2: "the variance of the features sharing the same action tag, averaged
    over action categories"). Actions with fewer than two clips are left out. Unit: feature units. Range 0 to infinity;
    best near the value of real clips. NaN if every action is left out.
    """
    drawn = [clips[torch.randint(len(clips), (2, pairs), generator=generator)] for clips in _actions(tags)]
    return float(_distances(features, torch.stack(drawn, dim=1)).mean()) if drawn else float("nan")


def expected_multimodality(features: Tensor, tags: Tensor) -> float:
    """What `multimodality` is on average: the mean over actions of the mean distance over all ordered pairs within one.

    features (N, E), multi-hot tags (N, A). Pairs of a clip with itself count, as in `expected_diversity`. Actions with
    fewer than two clips are left out. Unit: feature units. Range 0 to infinity; best near the value of real clips. NaN
    if every action is left out. Source: the expectation of Guo et al. 2020, section 5.1.
    """
    distances = [_mean_distance(features[clips].double()) for clips in _actions(tags)]
    return float(torch.stack(distances).mean()) if distances else float("nan")


def _require_clips(features: Tensor) -> None:
    if len(features) < 2:
        raise ValueError(f"diversity needs at least 2 clips, not {len(features)}")


def _actions(tags: Tensor) -> list[Tensor]:
    """The numbers of the clips of every action that has at least two."""
    clips = [column.nonzero().squeeze(1) for column in (tags > 0).T]
    return [numbers for numbers in clips if len(numbers) >= 2]


def _distances(features: Tensor, pairs: Tensor) -> Tensor:
    """Distances of paired clips (2, ...), in float64. Only the drawn clips are looked at."""
    first, second = pairs
    return (features[first].double() - features[second].double()).norm(dim=-1)


def _mean_distance(features: Tensor) -> Tensor:
    sums = [block.sum() for block in distance_blocks(features, features, exact=False)]
    return torch.stack(sums).sum() / len(features) ** 2
