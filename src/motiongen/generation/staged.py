"""The staged generator: encoder, conditioning, unroller and decoder under a training scheme."""

from __future__ import annotations

import torch
from torch import Tensor

from motiongen.contracts import (
    Builder,
    CompositionError,
    Condition,
    Conditioning,
    Controls,
    Decoder,
    Dimensions,
    Encoder,
    GeneratorModule,
    MotionBatch,
    Posterior,
    Prediction,
    TrainingScheme,
    Unroller,
)
from motiongen.generation.embeddings import Embeddings
from motiongen.options import PositiveInt


class StagedGenerator(GeneratorModule):
    """z ~ encoder, z' = conditioning(z), controls = unroller(z'), motion = decoder(controls).

    Args:
        features: F, numbers of a pose.
        tags: A, size of the tag vocabulary.
        initial_frames: K, frames of the initial motion.
        width: D, of codes, controls and embeddings.
        encoder, conditioning, unroller, decoder: builders of the stages.
        training: how the decoder is shown its past while it learns.

    Raises:
        CompositionError: the stages cannot work together, or one of them would have no effect.
    """

    def __init__(
        self,
        *,
        features: int,
        tags: int,
        initial_frames: int,
        width: PositiveInt,
        encoder: Builder[Encoder],
        conditioning: Builder[Conditioning],
        unroller: Builder[Unroller],
        decoder: Builder[Decoder],
        training: TrainingScheme,
    ) -> None:
        super().__init__()
        self.dimensions = Dimensions(features, tags, initial_frames, width)
        embeddings = Embeddings(self.dimensions)
        self.encoder = encoder(self.dimensions, embeddings)
        self.conditioning = conditioning(self.dimensions, embeddings)
        self.unroller = unroller(self.dimensions, embeddings)
        self.decoder = decoder(self.dimensions, embeddings)
        self.scheme = training
        if training.needs_past and not self.decoder.autoregressive:
            raise CompositionError(
                f"the training scheme {type(training).__name__} shapes the past that a decoder sees, but "
                f"{type(self.decoder).__name__} does not read the past, so the scheme would have no effect; "
                "choose another decoder or another generator/training"
            )

    def reconstruct(self, batch: MotionBatch, progress: float, generator: torch.Generator) -> Prediction:
        posterior = self.encoder.posterior(batch)
        controls = self._unroll(posterior, batch.condition, generator)
        prediction = self.scheme(self.decoder, controls, batch, progress, generator)
        return Prediction(prediction.motion, posterior, prediction.first_pass)

    def generate(self, condition: Condition, seed: int) -> Tensor:
        was_training = self.training
        self.eval()
        try:
            with torch.inference_mode():
                controls = self._unroll(self.encoder.prior(condition), condition, torch.Generator().manual_seed(seed))
                return self.decoder.generate(controls, condition) * condition.mask.unsqueeze(-1)
        finally:
            self.train(was_training)

    def _unroll(self, posterior: Posterior, condition: Condition, generator: torch.Generator) -> Controls:
        code = self.conditioning(posterior.sample(generator), condition)
        return self.unroller(code, condition)
