"""How often, and how surely, the recognizer finds the wanted action."""

from __future__ import annotations

import math

from torch import Tensor
from torch.nn.functional import one_hot


def hits(logits: Tensor, tags: Tensor) -> Tensor:
    """Whether each clip's likeliest tag is one of its tags: logits (..., A), multi-hot tags (..., A) to bool (...)."""
    return tags.gather(-1, logits.argmax(dim=-1, keepdim=True)).squeeze(-1) > 0


def accuracy(logits: Tensor, tags: Tensor) -> float:
    """Recognition accuracy: the share of clips whose most likely tag is one of their tags.

    Range 0 to 1, higher is better. For one-hot tags the usual top-1 accuracy (Neural Marionette, section 5.1.2).
    """
    return float(hits(logits, tags).double().mean())


def top_k_accuracy(logits: Tensor, tags: Tensor, k: int) -> float:
    """The share of clips that have one of their tags among the k most likely ones.

    logits (N, A), multi-hot tags (N, A). No unit. Range 0 to 1, higher is better; 1 for k = A and clips with a tag. k =
    1 is `accuracy`. Source: Russakovsky et al. 2015 (ImageNet), whose top-5 error is one minus this for k = 5.

    Raises:
        ValueError: k below 1 or above A.
    """
    if not 1 <= k <= logits.shape[1]:
        raise ValueError(f"the {k} most likely of {logits.shape[1]} tags cannot be chosen")
    likely = logits.topk(k, dim=1).indices
    return float((tags.gather(1, likely) > 0).any(dim=1).double().mean())


def class_accuracy(logits: Tensor, tags: Tensor) -> Tensor:
    """`accuracy` of the clips of every tag by itself: (A,) float64, NaN for a tag that no clip has."""
    members = (tags > 0).double()
    return (members * hits(logits, tags).double().unsqueeze(1)).sum(dim=0) / members.sum(dim=0)


def balanced_accuracy(logits: Tensor, tags: Tensor) -> float:
    """The mean of `class_accuracy` over the tags that have clips, so that a rare action counts as much as a common one.

    logits (N, A), multi-hot tags (N, A). No unit. Range 0 to 1, higher is better; NaN without any clip. For one-hot
    tags the mean recall of Brodersen et al. 2010.
    """
    return float(class_accuracy(logits, tags).nanmean())


def confusion(logits: Tensor, tags: Tensor) -> Tensor:
    """How many clips of every wanted tag the recognizer took for every tag.

    logits (N, A), multi-hot tags (N, A) to (A, A) float64: row the wanted tag, column the most likely one. A clip with
    several tags shares its one count equally among their rows; a clip without a tag counts nowhere. Unit: clips. Range
    0 to N; all on the diagonal is best for one-hot tags, whereas a share of a clip with several tags lies beside it
    always.
    """
    wanted = (tags > 0).double()
    shares = wanted / wanted.sum(dim=1, keepdim=True).clamp(min=1)
    return shares.T @ one_hot(logits.argmax(dim=1), logits.shape[1]).double()


def inception_score(logits: Tensor) -> float:
    """How sure the recognizer is of every clip, and how many tags it sees among all of them.

    exp(mean over clips of KL(p(y | x) || p(y))), p(y | x) the softmax of logits (N, A), p(y) its mean over clips. No
    unit. Range 1 (every clip looks the same to the recognizer) to A (every tag equally often, each beyond doubt); best
    near the value of real clips, as clips of the wrong action score as well as those of the right one. Grows with N up
    to its limit, so only values of equal N compare. Over all clips at once, not the mean over ten parts of the
    original's code. Source: Salimans et al. 2016, section 4.

    Raises:
        ValueError: no clips.
    """
    if not len(logits):
        raise ValueError("the inception score needs at least 1 clip")
    given = logits.double().log_softmax(dim=1)
    marginal = given.logsumexp(dim=0) - math.log(len(logits))
    return float((given.exp() * (given - marginal)).sum(dim=1).mean().exp())
