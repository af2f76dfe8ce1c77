"""Action and style: where a motion starts, what a classifier fills in, and what it says of generated motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import torch
import torch.nn.functional as F
from torch import Tensor, nn
from torch.func import functional_call

from motiongen.contracts import Condition, Posterior
from motiongen.objectives.terms import squared_error

FIRST_DEVIATION = 0.1
"""Of the initial state, before training."""


class InitialState(nn.Module):
    """A learned Gaussian over h_0 for every combination of attributes (Ghorbani et al. 2020, section 4.2).

    Mean and log-variance are sums of a part that all motions share, one of the action, one of the style and one of the
    two together, so that a combination without training motion starts from what its attributes have in common with
    others. Several tags at once are averaged; unknown attributes contribute nothing.

    Args:
        tags: A, actions.
        styles: S, may be 0.
        width: H.
    """

    def __init__(self, tags: int, styles: int, width: int) -> None:
        super().__init__()
        parts = 1 + tags + styles + tags * styles
        self.mean = nn.Parameter(torch.zeros(parts, width))
        self.log_variance = nn.Parameter(torch.zeros(parts, width))
        nn.init.constant_(self.log_variance[0], 2 * math.log(FIRST_DEVIATION))

    def forward(self, condition: Condition) -> Posterior:
        """A distribution over (B, H)."""
        tags, styles = shares(condition.tags), shares(condition.styles)
        pairs = (tags.unsqueeze(2) * styles.unsqueeze(1)).flatten(1)
        parts = torch.cat([torch.ones_like(tags[:, :1]), tags, styles, pairs], dim=1)
        return Posterior(parts @ self.mean, parts @ self.log_variance)


@dataclass(frozen=True)
class Judgement:
    """What a classifier sees in motions."""

    logits: Tensor
    """(B, C)"""
    features: tuple[Tensor, ...]
    """(B, T, any), of the layers before."""


class AttributeClassifiers(nn.Module):
    """A classifier for every attribute that the data has: `tags`, `styles` (Ghorbani et al. 2020, section 3.4).

    They learn from the labels of recorded motion beside the generator (`loss`), and give it the attributes of motion
    without labels (`completed`) and a further loss on what it reconstructs (`disagreement`), from which they do not
    learn. The paper trains them beforehand.

    Args:
        classifiers: field of the condition -> classifier.
    """

    def __init__(self, classifiers: dict[str, nn.Module]) -> None:
        super().__init__()
        self.classifiers = nn.ModuleDict(classifiers)

    def forward(self, poses: Tensor, mask: Tensor) -> dict[str, Judgement]:
        """Poses (B, T, P) of recorded motion, mask (B, T)."""
        return {name: Judgement(*classifier(poses, mask)) for name, classifier in self.classifiers.items()}

    def completed(self, condition: Condition, judged: Mapping[str, Judgement]) -> Condition:
        """The condition with the likeliest value of every attribute that it does not know."""
        return replace(condition, **{n: _known(getattr(condition, n), own.logits) for n, own in judged.items()})

    def loss(self, condition: Condition, judged: Mapping[str, Judgement]) -> Tensor:
        """Cross-entropy of the labels that are known, a scalar."""
        terms = [cross_entropy(own.logits, getattr(condition, name)) for name, own in judged.items()]
        return torch.stack(terms).sum()

    def disagreement(
        self, poses: Tensor, mask: Tensor, condition: Condition, judged: Mapping[str, Judgement]
    ) -> Tensor:
        """Loss of reconstructed poses (B, T, P) (Eq. 24, beta = 1), a scalar.

        Cross-entropy of the completed condition's attributes, and squared error between the features of reconstructed
        and recorded motion in every layer.
        """
        terms = []
        for name, classifier in self.classifiers.items():
            frozen = {key: parameter.detach() for key, parameter in classifier.named_parameters()}
            made = Judgement(*functional_call(classifier, frozen, (poses, mask)))
            terms.append(cross_entropy(made.logits, getattr(condition, name)))
            layers = zip(made.features, judged[name].features, strict=True)
            terms += [squared_error(one, other.detach(), mask) for one, other in layers]
        return torch.stack(terms).sum()


def _known(labels: Tensor, logits: Tensor) -> Tensor:
    """Labels (B, C), and where a row has none, the likeliest one."""
    guess = F.one_hot(logits.argmax(dim=1), logits.shape[1]).to(labels)
    return torch.where(labels.any(dim=1, keepdim=True), labels, guess)


def cross_entropy(logits: Tensor, labels: Tensor) -> Tensor:
    """Logits (B, C), multi-hot labels (B, C): mean over the rows that have a label, whose labels share the weight."""
    entropy = F.cross_entropy(logits, shares(labels), reduction="none")
    return entropy.sum() / labels.any(dim=1).sum().clamp(min=1)


def shares(labels: Tensor) -> Tensor:
    """Multi-hot rows (B, C) that sum to 1; zero stays zero."""
    return labels / labels.sum(dim=1, keepdim=True).clamp(min=1)
