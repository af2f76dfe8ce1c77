"""Small generators and random batches that several tests share."""

from __future__ import annotations

from functools import partial

import torch

from motiongen.contracts import Condition, GeneratorModule, MotionBatch, TrainingScheme
from motiongen.generation.conditioning import Unconditioned
from motiongen.generation.staged import StagedGenerator
from motiongen.motion.representation import FEATURES
from motiongen.motion.skeleton import JOINTS, Skeleton
from motiongen_plugins.autoregressive_transformer.autoregressive_transformer import AutoregressiveTransformer
from motiongen_plugins.condition_encoder.condition_encoder import ConditionEncoder
from motiongen_plugins.one_shot_transformer.one_shot_transformer import OneShotTransformer
from motiongen_plugins.reverse_positional_encoding.reverse_positional_encoding import ReversePositionalEncoding
from motiongen_plugins.scheduled_sampling.scheduled_sampling import ScheduledSampling
from motiongen_plugins.sinusoidal_queries.sinusoidal_queries import SinusoidalQueries
from motiongen_plugins.tag_injection.tag_injection import TagInjection
from motiongen_plugins.time_unrolling.time_unrolling import TimeUnrolling
from motiongen_plugins.trajectory_branch.trajectory_branch import TrajectoryBranch

TAGS = 5
STYLES = 3
INITIAL_FRAMES = 6
WIDTH = 32


def marionet(training: TrainingScheme | None = None, dropout: float = 0.0, residual: float = 0.0) -> StagedGenerator:
    """MARIONET's composition, small, with weights from seed 0."""
    torch.manual_seed(0)
    transformer = {"heads": 4, "feedforward": 48, "dropout": dropout}
    return StagedGenerator(
        features=FEATURES,
        tags=TAGS,
        initial_frames=INITIAL_FRAMES,
        width=WIDTH,
        encoder=partial(ConditionEncoder, layers=1, **transformer),
        conditioning=Unconditioned,
        unroller=partial(
            TimeUnrolling,
            query={"reverse_positional_encoding": ReversePositionalEncoding, "tag_injection": TagInjection},
            branches={
                "trajectory_branch": partial(
                    TrajectoryBranch, width=8, layers=1, heads=1, feedforward=16, dropout=dropout
                )
            },
            layers=1,
            **transformer,
        ),
        decoder=partial(AutoregressiveTransformer, layer_input={}, layers=2, residual=residual, **transformer),
        training=training or ScheduledSampling(activate=0.25, accomplish=0.75),
    )


def cannot_be_reached(generator: GeneratorModule) -> set[str]:
    """Parameters that have no influence, whatever their values.

    Attention to a single vector gives it the weight 1, whatever is asked. So where ACTOR's decoder, whose memory is z'
    alone, normalises first, the normalisation of what asks changes nothing.
    """
    decoder, unroller = (getattr(generator, stage, None) for stage in ("decoder", "unroller"))
    if not (isinstance(decoder, OneShotTransformer) and isinstance(unroller, SinusoidalQueries)):
        return set()
    return {
        f"decoder.transformer.layers.{number}.norm2.{part}"
        for number, layer in enumerate(decoder.transformer.layers)
        if layer.norm_first
        for part in ("weight", "bias")
    }


def skeleton() -> Skeleton:
    """Bones of 5 to 30 cm in random directions."""
    generator = torch.Generator().manual_seed(3)
    offsets = 0.2 * torch.randn(JOINTS, 3, generator=generator)
    offsets[0] = 0
    return Skeleton(offsets)


def batch(lengths: tuple[int, ...], frames: int | None = None, seed: int = 0) -> MotionBatch:
    """Random motion and condition of the given lengths, padded with zeros to `frames` (default: the longest)."""
    generator = torch.Generator().manual_seed(seed)
    frames = frames or max(lengths)
    motions, paths = torch.zeros(len(lengths), frames, FEATURES), torch.zeros(len(lengths), frames, 2)
    mask = torch.zeros(len(lengths), frames, dtype=torch.bool)
    initial = torch.zeros(len(lengths), INITIAL_FRAMES, FEATURES)
    for row, length in enumerate(lengths):
        motions[row, :length] = torch.randn(length, FEATURES, generator=generator)
        paths[row, :length] = torch.randn(length, 2, generator=generator)
        initial[row] = torch.randn(INITIAL_FRAMES, FEATURES, generator=generator)
        mask[row, :length] = True
    tags = torch.eye(TAGS)[torch.arange(len(lengths)) % TAGS]
    styles = torch.eye(STYLES)[torch.arange(len(lengths)) % STYLES]
    return MotionBatch(motions, Condition(tags, tags.roll(1, dims=0), initial, paths, mask, styles))
