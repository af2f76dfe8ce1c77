"""The staged generator: encoder, conditioning, unroller and decoder under a training scheme."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import torch
from torch import Tensor

from motiongen.contracts import (
    BeginOfPose,
    Builder,
    Code,
    CompositionError,
    Condition,
    Conditioning,
    Controls,
    Decoder,
    Dimensions,
    Encoder,
    GeneratorModule,
    MotionBatch,
    PoseForm,
    Posterior,
    Prediction,
    StartsFromPose,
    TrainingScheme,
    Unroller,
)
from motiongen.generation.dropout import with_quick_dropout
from motiongen.generation.embeddings import Embeddings
from motiongen.generation.pose_forms import Rot6d
from motiongen.options import PositiveInt


class StagedGenerator(GeneratorModule):
    """z ~ encoder, z' = conditioning(z), controls = unroller(z'), motion = decoder(controls).

    Args:
        features: F, numbers of a pose in 6D form, as batches and predictions have it.
        tags: A, size of the tag vocabulary.
        initial_frames: K, frames of the initial motion.
        styles: S, size of the style vocabulary.
        width: D, of codes, controls and embeddings.
        encoder, conditioning, unroller, decoder: builders of the stages.
        training: how the decoder is shown its past while it learns.
        pose: from F to the form in which the stages see poses; `dimensions.features` is what it takes for one.

    Raises:
        CompositionError: the stages cannot work together, or one of them would have no effect.
    """

    def __init__(
        self,
        *,
        features: int,
        tags: int,
        initial_frames: int,
        styles: int = 0,
        width: PositiveInt,
        encoder: Builder[Encoder],
        conditioning: Builder[Conditioning],
        unroller: Builder[Unroller],
        decoder: Builder[Decoder],
        training: TrainingScheme,
        pose: Callable[[int], PoseForm] = Rot6d,
    ) -> None:
        super().__init__()
        self.pose = pose(features)
        self.dimensions = Dimensions(self.pose.features, tags, initial_frames, width, styles)
        embeddings = Embeddings(self.dimensions)
        self.encoder = encoder(self.dimensions, embeddings)
        self.conditioning = conditioning(self.dimensions, embeddings)
        self.unroller = unroller(self.dimensions, embeddings)
        self.decoder = decoder(self.dimensions, embeddings)
        self.scheme = training
        refuse_what_cannot_work(self.encoder, self.conditioning, self.unroller, self.decoder, training)
        with_quick_dropout(self)

    def reconstruct(self, batch: MotionBatch, progress: float, generator: torch.Generator) -> Prediction:
        batch = encoded(batch, self.pose)
        posterior = self.encoder.posterior(batch)
        code = self._drawn(posterior, batch, generator)
        controls = self.unroller(code, batch.condition)
        prediction = self.scheme(self.decoder, controls, batch, progress, generator)
        return replace(decoded(prediction, self.pose), posterior=posterior)

    def code(self, batch: MotionBatch, generator: torch.Generator) -> Code:
        batch = encoded(batch, self.pose)
        return self._drawn(self.encoder.posterior(batch), batch, generator)

    def _drawn(self, posterior: Posterior, batch: MotionBatch, generator: torch.Generator) -> Code:
        latent = posterior.sample(generator)
        return Code(latent, self.conditioning.reconstruct(latent, batch, generator))

    @property
    def reads(self) -> frozenset[str]:
        stages = (self.encoder, self.conditioning, self.unroller, self.decoder)
        return frozenset({"mask"}).union(*(stage.reads for stage in stages))

    def generate(self, condition: Condition, seed: int) -> Tensor:
        return self._generate(self.decoder.generate, condition, seed)

    def generate_from(self, begin_of_pose: BeginOfPose, condition: Condition, seed: int) -> Tensor:
        decoder = self.decoder
        if not isinstance(decoder, StartsFromPose):
            raise CompositionError(
                f"{type(decoder).__name__} does not begin with an embedded pose that could be replaced; choose a "
                "generator/decoder that does, such as autoregressive_transformer"
            )

        def decode(controls: Controls, condition: Condition) -> Tensor:
            own = decoder.begin_of_pose(condition)
            return decoder.generate_from(begin_of_pose(own, condition.tags, decoder.beginnings), controls, condition)

        return self._generate(decode, condition, seed)

    def _generate(self, decode: Callable[[Controls, Condition], Tensor], condition: Condition, seed: int) -> Tensor:
        was_training = self.training
        self.eval()
        generator = torch.Generator().manual_seed(seed)
        try:
            with torch.inference_mode():
                condition = replace(condition, initial_motion=self.pose.encode(condition.initial_motion))
                latent = self.encoder.prior(condition).sample(generator)
                code = Code(latent, self.conditioning(latent, condition, generator))
                motion = self.pose.decode(decode(self.unroller(code, condition), condition))
                return motion * condition.mask.unsqueeze(-1)
        finally:
            self.train(was_training)

    def conclude(self, batches: Iterable[MotionBatch]) -> None:
        device = next(self.parameters()).device
        self.conditioning.conclude(encoded(batch.to(device), self.pose) for batch in batches)
        if isinstance(self.decoder, StartsFromPose):
            self.decoder.conclude(encoded(batch.to(device), self.pose) for batch in batches)


def encoded(batch: MotionBatch, pose: PoseForm) -> MotionBatch:
    """The batch as stages see it. Initial motion and motion are one clip, so a form that is continuous has no seam."""
    initial, motion = batch.condition.initial_motion, batch.motion
    clip = pose.encode(torch.cat([initial, motion], dim=1))
    initial, motion = clip.split([initial.shape[1], motion.shape[1]], dim=1)
    motion = motion.masked_fill(~batch.condition.mask.unsqueeze(-1), 0.0)
    return MotionBatch(motion, replace(batch.condition, initial_motion=initial))


def decoded(prediction: Prediction, pose: PoseForm) -> Prediction:
    """What a training scheme made, as objectives see it."""
    first_pass = None if prediction.first_pass is None else pose.decode(prediction.first_pass)
    return replace(prediction, motion=pose.decode(prediction.motion), first_pass=first_pass)


def refuse_what_cannot_work(
    encoder: Encoder, conditioning: Conditioning, unroller: Unroller, decoder: Decoder, training: TrainingScheme
) -> None:
    """Raises CompositionError where the stages cannot work together, or a choice would have no effect."""
    if training.needs_past and not decoder.autoregressive:
        raise CompositionError(
            f"the training scheme {type(training).__name__} shapes the past that a decoder sees, but "
            f"{type(decoder).__name__} does not read the past, so the scheme would have no effect; "
            "choose another decoder or another generator/training"
        )
    if not training.needs_past and decoder.autoregressive:
        raise CompositionError(
            f"{type(decoder).__name__} reads the past, which {type(training).__name__} does not shape; "
            "choose generator/training=teacher_forcing or scheduled_sampling"
        )
    if not unroller.carries & decoder.uses:
        raise CompositionError(
            f"{type(unroller).__name__} puts the code into {_listed(unroller.carries)}, and {type(decoder).__name__} "
            f"reads {_listed(decoder.uses)} alone, so the code would never reach it; choose another generator/unroller"
        )
    if not (decoder.keeps_time or unroller.keeps_time):
        raise CompositionError(
            f"{type(unroller).__name__} gives every frame the same query, and {type(decoder).__name__} tells frames "
            "apart by nothing else, so the motion would stand still; choose another generator/unroller or "
            "generator/decoder"
        )
    if not any("tags" in stage.reads for stage in (encoder, conditioning, unroller, decoder)):
        stages = ", ".join(type(stage).__name__ for stage in (encoder, conditioning, unroller, decoder))
        raise CompositionError(
            f"no stage reads the action when it generates ({stages}); choose a generator/conditioning that does"
        )


def _listed(names: Iterable[str]) -> str:
    return " and ".join(f"controls.{name}" for name in sorted(names))
