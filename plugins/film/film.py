"""UM-CVAE's action-aware modulation (section 3.1, Eq. 3)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

import torch
from torch import Tensor, nn

from motiongen.contracts import Condition, Conditioning, Dimensions, MotionBatch
from motiongen.generation.embeddings import Embeddings
from motiongen.options import PositiveInt, Share
from motiongen_plugins.film.action_aware_encoder import ActionAwareEncoder
from motiongen_plugins.film.bank import FilmBank


class FiLM(Conditioning):
    """z' = gamma * z + beta, with gamma and beta from the action-aware encoder's features of a motion and its label.

    In training they come from the motion that is reconstructed. When training is over, those of all training motions go
    to the bank; in use one of the action's is drawn from it. Where the bank has nothing of the action (before training:
    of any), the encoder looks at a single frame of zeros with the action's label instead.

    Args:
        interpolation: how far two of the action's entries may be mixed in use, 0 (one of them as it is) to 1.
        channels, graph_layers, candidates, temporal_layers, kernel: of the action-aware encoder.

    Raises:
        CompositionError: poses that the action-aware encoder cannot take apart into joints.
    """

    reads: ClassVar[frozenset[str]] = frozenset({"tags"})

    def __init__(
        self,
        dimensions: Dimensions,
        embeddings: Embeddings,
        *,
        interpolation: Share,
        channels: PositiveInt,
        graph_layers: PositiveInt,
        candidates: PositiveInt,
        temporal_layers: PositiveInt,
        kernel: PositiveInt,
    ) -> None:
        super().__init__()
        self.interpolation = interpolation
        self.features = dimensions.features
        self.encoder = ActionAwareEncoder(
            dimensions,
            channels=channels,
            graph_layers=graph_layers,
            candidates=candidates,
            temporal_layers=temporal_layers,
            kernel=kernel,
        )
        self.modulation = nn.Linear(dimensions.width, 2 * dimensions.width)
        # gamma starts around 1 (Perez et al. 2018, section 7.2): near 0 it would switch the code off.
        nn.init.ones_(self.modulation.bias[: dimensions.width])
        self.bank = FilmBank(dimensions.tags, 2 * dimensions.width)

    def reconstruct(self, latent: Tensor, batch: MotionBatch, generator: torch.Generator) -> Tensor:
        return modulate(latent, self.of_motion(batch))

    def forward(self, latent: Tensor, condition: Condition, generator: torch.Generator) -> Tensor:
        alone = self.of_label(condition.tags)
        return modulate(latent, self.bank.draw(condition.tags, alone, self.interpolation, generator))

    def conclude(self, batches: Iterable[MotionBatch]) -> None:
        with torch.no_grad():
            filed = [(batch.condition.tags, self.of_motion(batch)) for batch in batches]
        tags, parameters = zip(*filed, strict=True)
        self.bank.fill(torch.cat(tags), torch.cat(parameters))

    def of_motion(self, batch: MotionBatch) -> Tensor:
        """Gamma and beta, one behind the other, (B, 2 D)."""
        return self.modulation(self.encoder(batch.motion, batch.condition.tags, batch.condition.mask))

    def of_label(self, tags: Tensor) -> Tensor:
        """What the label alone gives, (B, 2 D)."""
        frame = tags.new_zeros(len(tags), 1, self.features)
        return self.modulation(self.encoder(frame, tags, tags.new_ones(len(tags), 1, dtype=torch.bool)))


def modulate(latent: Tensor, parameters: Tensor) -> Tensor:
    """Eq. 3: latent (B, D), gamma and beta (B, 2 D), to (B, D)."""
    gamma, beta = parameters.chunk(2, dim=-1)
    return gamma * latent + beta
