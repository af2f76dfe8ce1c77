"""How often the recognizer finds the wanted action."""

from __future__ import annotations

from torch import Tensor


def hits(logits: Tensor, tags: Tensor) -> Tensor:
    """Whether each clip's most likely tag is one of its tags: logits (N, A), multi-hot tags (N, A) to bool (N,)."""
    return tags.gather(1, logits.argmax(dim=1, keepdim=True)).squeeze(1) > 0


def accuracy(logits: Tensor, tags: Tensor) -> float:
    """Recognition accuracy: the share of clips whose most likely tag is one of their tags.

    Range 0 to 1, higher is better. For one-hot tags the usual top-1 accuracy (Neural Marionette, section 5.1.2).
    """
    return float(hits(logits, tags).double().mean())


def class_accuracy(logits: Tensor, tags: Tensor) -> Tensor:
    """`accuracy` of the clips of every tag by itself: (A,) float64, NaN for a tag that no clip has."""
    members = (tags > 0).double()
    return (members * hits(logits, tags).double().unsqueeze(1)).sum(dim=0) / members.sum(dim=0)
