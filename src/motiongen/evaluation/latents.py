"""The codes of the test clips before and after conditioning (UM-CVAE, Fig. 5), and what they tell of the action."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from motiongen.contracts import GeneratorModule, MotionBatch
from motiongen.evaluation.metrics.classification import accuracy
from motiongen.files import replacing

if TYPE_CHECKING:
    from motiongen.data.datamodule import MotionData

LATENTS_FILE = "latents.png"
"""The picture in a run's folder and among its artifacts in MLflow."""
MARKERS = "osv^D"


@dataclass(frozen=True)
class Codes:
    """The codes of N recorded motions, on the CPU in float64."""

    latent: Tensor
    """(N, D), drawn from the posterior"""
    modulated: Tensor
    """(N, D'), what the condition made of them"""
    tags: Tensor
    """(N, A) multi-hot"""


@dataclass(frozen=True)
class LatentSpace:
    """The codes of the test clips on two planes, and how well the action can be read from them."""

    latent: Tensor
    """(N, 2): before conditioning, on its principal plane"""
    modulated: Tensor
    """(N, 2): after it, on a plane of its own"""
    tags: Tensor
    """(N, A) multi-hot"""
    names: tuple[str, ...]
    """Of the columns of tags"""
    before: float
    """Accuracy of `nearest_centroid` before conditioning"""
    after: float
    commonest: float
    """Share of the clips that bear the commonest tag: the accuracy of naming it always"""

    def figures(self) -> dict[str, float]:
        """For summary.json and trackers."""
        return {
            "tag_from_latent": self.before,
            "tag_from_modulated": self.after,
            "tag_by_commonest": self.commonest,
        }


def latent_space(generator: GeneratorModule, data: MotionData, batch_size: int, seed: int) -> LatentSpace | None:
    """What the codes of this data's test clips look like; None for a generator without codes.

    Codes are drawn from the posterior, not its means: what of the action is below the noise does not reach the decoder.

    Args:
        generator: trained, in eval mode.
        data: whose training clips give the centroids.
        batch_size: of the motions that are encoded at once.
        seed: of the draws.
    """
    noise = torch.Generator().manual_seed(seed)
    tested = codes_of(generator, data.test_batches(batch_size), noise)
    known = codes_of(generator, data.train_windows(batch_size), noise)
    if tested is None or known is None:
        return None
    return LatentSpace(
        latent=principal_plane(tested.latent),
        modulated=principal_plane(tested.modulated),
        tags=tested.tags,
        names=data.tags,
        before=nearest_centroid(tested.latent, tested.tags, known.latent, known.tags),
        after=nearest_centroid(tested.modulated, tested.tags, known.modulated, known.tags),
        commonest=float(tested.tags.mean(dim=0).max()),
    )


@torch.inference_mode()
def codes_of(generator: GeneratorModule, batches: Iterable[MotionBatch], noise: torch.Generator) -> Codes | None:
    """The codes of all motions in these batches, in order."""
    device = next(generator.parameters()).device
    parts: list[tuple[Tensor, Tensor, Tensor]] = []
    for batch in batches:
        code = generator.code(batch.to(device), noise)
        if code is None:
            return None
        parts.append((code.latent, code.modulated, batch.condition.tags))
    return Codes(*(torch.cat(own).double().cpu() for own in zip(*parts, strict=True)))


def nearest_centroid(codes: Tensor, tags: Tensor, known: Tensor, known_tags: Tensor) -> float:
    """The share of codes whose nearest centroid is that of one of their tags.

    A centroid is the mean of the known codes with its tag. Range 0 to 1; that of a code that knows nothing of the
    action is that of guessing. Source: the nearest-mean classifier, Hastie et al. 2009, section 4.3.

    Args:
        codes: (N, D).
        tags: (N, A) multi-hot.
        known: (M, D) codes that give the centroids.
        known_tags: (M, A) multi-hot; tags that none of them has are never the nearest.
    """
    counts = known_tags.sum(dim=0)
    centroids = (known_tags.T @ known) / counts.clamp(min=1).unsqueeze(1)
    distances = torch.cdist(codes, centroids).masked_fill(counts == 0, torch.inf)
    return accuracy(-distances, tags)


def principal_plane(codes: Tensor) -> Tensor:
    """Codes (N, D) on their two principal axes, (N, 2); an axis points to where its largest entry is positive.

    Zero for an axis that there is not, of a single code or one number.
    """
    centred = codes - codes.mean(dim=0)
    _, _, axes = torch.linalg.svd(centred, full_matrices=False)
    axes = axes[:2]
    signs = axes.gather(1, axes.abs().argmax(dim=1, keepdim=True)).sign()
    plane = centred @ (axes * signs).T
    return torch.nn.functional.pad(plane, (0, 2 - plane.shape[1]))


def draw_latents(path: Path, space: LatentSpace) -> None:
    """A PNG with the codes before and after conditioning side by side, coloured by (first) tag."""
    import matplotlib
    from matplotlib.figure import Figure

    first = space.tags.argmax(dim=1)
    shown = first.unique().tolist()
    colours = matplotlib.colormaps["turbo"].resampled(max(2, len(shown)))
    figure = Figure(figsize=(10.0, 5.0), layout="constrained")
    panels = figure.subplots(1, 2)
    titles = (f"before conditioning: action read {space.before:.0%}", f"after: {space.after:.0%}")
    for panel, points, title in zip(panels, (space.latent, space.modulated), titles, strict=True):
        for number, column in enumerate(shown):
            own = points[first == column]
            marker = MARKERS[number % len(MARKERS)]
            panel.scatter(own[:, 0], own[:, 1], s=14, color=colours(number), marker=marker, label=space.names[column])
        panel.set_title(title, fontsize=10)
        panel.set_xticks([])
        panel.set_yticks([])
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", fontsize=8, ncols=-(-len(shown) // 20))
    figure.suptitle(
        f"codes of {len(first)} test clips, principal axes; the commonest action is {space.commonest:.0%}", fontsize=9
    )
    with replacing(path) as partial:
        figure.savefig(partial, dpi=110)
