"""The types that stages exchange, and the protocols that plugins implement.

Shapes: B batch, T frames, F pose features, D latent width, M memory tokens, A tags, K initial frames. Batch first;
masks are True where a frame is valid; metres, radians, 30 Hz unless the data says otherwise; world z up.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, ClassVar, Protocol, Self, TypeVar, runtime_checkable

import torch
from torch import Tensor, nn

from motiongen.errors import InputError

if TYPE_CHECKING:
    from motiongen.generation.bank import TaggedBank
    from motiongen.generation.embeddings import Embeddings


class CompositionError(InputError):
    """Stages that were chosen together cannot work together, or one of them would have no effect."""


@dataclass(frozen=True)
class Condition:
    """All that a user can supply; a generator sees nothing else at run time."""

    tags: Tensor
    """(B, A) multi-hot: the action to generate."""
    next_tags: Tensor
    """(B, A) multi-hot: the action that follows; zero where it is unknown."""
    initial_motion: Tensor
    """(B, K, F): the frames just before the action, in the canonical frame of the last of them."""
    trajectory: Tensor
    """(B, T, 2): ground-plane root position in the canonical frame, metres; zero where it is not specified."""
    mask: Tensor
    """(B, T) bool: True for the frames to generate."""
    styles: Tensor
    """(B, S) multi-hot: the manner of the action; zero where it is unknown. S is 0 for data without styles."""

    @property
    def lengths(self) -> Tensor:
        """(B,) frames to generate."""
        return self.mask.sum(dim=1)

    def to(self, device: torch.device | str) -> Self:
        return replace(self, **{field.name: getattr(self, field.name).to(device) for field in fields(self)})

    def rows(self, chosen: Tensor) -> Self:
        """The conditions that a mask (B,) or numbers choose."""
        return replace(self, **{field.name: getattr(self, field.name)[chosen] for field in fields(self)})


@dataclass(frozen=True)
class MotionBatch:
    """Motion with the condition that it answers."""

    motion: Tensor
    """(B, T, F), canonical frame of the condition; padded frames are zero."""
    condition: Condition

    @property
    def past(self) -> Tensor:
        """P_0 .. P_{T-1}, (B, T, F): the motion one frame late, behind the last initial pose."""
        return torch.cat([self.condition.initial_motion[:, -1:], self.motion[:, :-1]], dim=1)

    def to(self, device: torch.device | str) -> MotionBatch:
        return MotionBatch(self.motion.to(device), self.condition.to(device))


@dataclass(frozen=True)
class Posterior:
    """A diagonal Gaussian over the action-level code z."""

    mean: Tensor
    """(B, D)"""
    log_variance: Tensor
    """(B, D)"""

    def sample(self, generator: torch.Generator) -> Tensor:
        """Reparameterised draw, (B, D). `generator` lives on the CPU, so that a seed means the same on every device."""
        noise = torch.randn(self.mean.shape, generator=generator).to(self.mean)
        return self.mean + torch.exp(0.5 * self.log_variance) * noise


@dataclass(frozen=True)
class Code:
    """The action-level code, before and after the condition changed it."""

    latent: Tensor
    """(B, D): z, as it was drawn."""
    modulated: Tensor
    """(B, D): z', what the conditioning made of it."""


@dataclass(frozen=True)
class Controls:
    """What an unroller tells a decoder."""

    queries: Tensor
    """(B, T, D): one vector for every frame to generate."""
    memory: Tensor
    """(B, M, D): what a decoder attends to."""
    mask: Tensor
    """(B, M) bool: which memory tokens are valid."""
    latent: Tensor
    """(B, D): z, for mechanisms that hand it to the decoder past conditioning and unroller."""


@dataclass(frozen=True)
class Prediction:
    """What a generator made of a training batch."""

    motion: Tensor
    """(B, T, F)"""
    posterior: Posterior | None = None
    first_pass: Tensor | None = None
    """(B, T, F): the motion that scheduled sampling fed back (Neural Marionette, supplement Fig. 2)."""
    terms: Mapping[str, Tensor] = field(default_factory=dict)
    """Loss terms that only the generator can compute: name to unweighted scalar."""


@dataclass(frozen=True)
class Dimensions:
    """The sizes that all stages of one generator share."""

    features: int
    tags: int
    initial_frames: int
    width: int
    styles: int = 0


class PoseForm(Protocol):
    """How the stages of a generator see the poses that everything outside of it has in 6D form."""

    features: int
    """F', numbers of a pose in this form."""

    def encode(self, features: Tensor) -> Tensor:
        """Clips (B, T, F), frames in order, to (B, T, F'). Padding is no pose: what comes of it is not used."""
        ...

    def decode(self, features: Tensor) -> Tensor:
        """What a decoder gives, (B, T, F') of any values, to (B, T, F); differentiable."""
        ...


class Encoder(Protocol):
    """Condition, and in training the motion, to the distribution of the action-level code."""

    @property
    def reads(self) -> frozenset[str]:
        """The fields of Condition that `prior` reads."""
        ...

    def posterior(self, batch: MotionBatch) -> Posterior:
        """The distribution that training samples from and the KL term measures."""
        ...

    def prior(self, condition: Condition) -> Posterior:
        """The distribution that generation samples from."""
        ...


class Conditioning(nn.Module):
    """z to z', under the condition."""

    reads: ClassVar[frozenset[str]]
    """The fields of Condition that `forward` reads."""

    def forward(self, latent: Tensor, condition: Condition, generator: torch.Generator) -> Tensor:
        """For use: (B, D) to (B, D). `generator` lives on the CPU and is there for what is drawn at random."""
        raise NotImplementedError

    def reconstruct(self, latent: Tensor, batch: MotionBatch, generator: torch.Generator) -> Tensor:
        """For training, where the motion may be looked at: (B, D) to (B, D)."""
        return self.forward(latent, batch.condition, generator)

    def conclude(self, batches: Iterable[MotionBatch]) -> None:
        """Called once when training is over: keep what `forward` needs of the training motions."""


class Unroller(Protocol):
    """The action-level code to frame-level controls."""

    @property
    def reads(self) -> frozenset[str]:
        """The fields of Condition that it reads."""
        ...

    @property
    def carries(self) -> frozenset[str]:
        """Which of `queries` and `memory` depend on the code."""
        ...

    @property
    def keeps_time(self) -> bool:
        """Whether its queries tell one frame from another."""
        ...

    def __call__(self, code: Code, condition: Condition) -> Controls: ...


class QueryMechanism(nn.Module):
    """One summand of an unroller's query."""

    reads: ClassVar[frozenset[str]]
    keeps_time: ClassVar[bool] = True
    """Whether it tells one frame from another."""

    def forward(self, condition: Condition) -> Tensor:
        """(B, T, D), or a shape that broadcasts to it."""
        raise NotImplementedError


class ControlBranch(nn.Module):
    """Further frame-level controls, concatenated to the unrolled codes."""

    reads: ClassVar[frozenset[str]]
    keeps_time: ClassVar[bool] = True
    """Whether it tells one frame from another."""
    width: int
    """Features that it takes of the D of every frame's control."""

    def forward(self, condition: Condition) -> Tensor:
        """(B, T, width)."""
        raise NotImplementedError


class LayerInput(nn.Module):
    """What a decoder adds to the input of each of its layers but the first."""

    def forward(self, controls: Controls) -> Tensor:
        """(B, T, D), or a shape that broadcasts to it."""
        raise NotImplementedError


class Decoder(Protocol):
    """Controls to motion."""

    @property
    def reads(self) -> frozenset[str]:
        """The fields of Condition that it reads."""
        ...

    @property
    def uses(self) -> frozenset[str]:
        """Which of the controls' `queries` and `memory` it reads."""
        ...

    autoregressive: ClassVar[bool]
    """Whether `forward` depends on `past`."""
    keeps_time: ClassVar[bool]
    """Whether it tells one frame from another even where their queries are the same."""

    def __call__(self, controls: Controls, condition: Condition, past: Tensor) -> Tensor:
        """Predict every frame from the one before: past (B, T, F) is the motion shifted one frame to the right."""
        ...

    def generate(self, controls: Controls, condition: Condition) -> Tensor:
        """Motion (B, T, F) from the controls alone, without gradient."""
        ...


class BeginOfPose(Protocol):
    """Makes another begin of pose out of the one that a decoder would start from."""

    def __call__(self, embedding: Tensor, tags: Tensor, bank: TaggedBank) -> Tensor:
        """f_0 (B, D), the action's tags (B, A) and the beginnings of the training clips to f*_0 (B, D)."""
        ...


@runtime_checkable
class StartsFromPose(Protocol):
    """A decoder whose first input is the embedded last pose before the action, so that another may take its place."""

    beginnings: TaggedBank
    """Of every training clip that embedding, (M, D); empty until `conclude`."""

    def begin_of_pose(self, condition: Condition) -> Tensor:
        """f_0, the embedding of the last initial pose, (B, D)."""
        ...

    def generate_from(self, begin_of_pose: Tensor, controls: Controls, condition: Condition) -> Tensor:
        """As `generate`, with the embedding (B, D) in place of f_0."""
        ...

    def conclude(self, batches: Iterable[MotionBatch]) -> None:
        """Called once when training is over: keep the training clips' beginnings."""
        ...


class TrainingScheme(Protocol):
    """How the decoder is shown its past while it learns."""

    needs_past: ClassVar[bool]
    """Whether the scheme has an effect on autoregressive decoders only."""

    def __call__(
        self, decoder: Decoder, controls: Controls, batch: MotionBatch, progress: float, generator: torch.Generator
    ) -> Prediction:
        """One training prediction; progress in [0, 1] is the share of the run that is done."""
        ...


Stage = TypeVar("Stage", covariant=True)


class Builder(Protocol[Stage]):
    """A stage whose options are bound (Hydra's `_partial_`), waiting for the sizes and embeddings that stages share."""

    def __call__(self, dimensions: Dimensions, embeddings: Embeddings) -> Stage: ...


class Generator(Protocol):
    """A model of motion. Training and use are two verbs, kept apart."""

    dimensions: Dimensions

    @property
    def reads(self) -> frozenset[str]:
        """The fields of Condition that `generate` reads."""
        ...

    def reconstruct(self, batch: MotionBatch, progress: float, generator: torch.Generator) -> Prediction:
        """For training: the batch's motion as the model would have made it."""
        ...

    def generate(self, condition: Condition, seed: int) -> Tensor:
        """For use: motion (B, T, F) in the condition's canonical frame; the same seed gives the same motion."""
        ...


class GeneratorModule(nn.Module):
    """A Generator that is also a torch module: what the training shell, checkpoints and tasks hold."""

    dimensions: Dimensions

    @property
    def reads(self) -> frozenset[str]:
        """The fields of Condition that `generate` reads; all of them unless a generator says otherwise."""
        return frozenset(one.name for one in fields(Condition))

    def reconstruct(self, batch: MotionBatch, progress: float, generator: torch.Generator) -> Prediction:
        raise NotImplementedError

    def generate(self, condition: Condition, seed: int) -> Tensor:
        raise NotImplementedError

    def generate_from(self, begin_of_pose: BeginOfPose, condition: Condition, seed: int) -> Tensor:
        """As `generate`, but the embedding of the last initial pose is what `begin_of_pose` makes of it.

        Raises:
            CompositionError: this generator does not begin with an embedded pose.
        """
        raise CompositionError(f"{type(self).__name__} does not begin with an embedded pose that could be replaced")

    def code(self, batch: MotionBatch, generator: torch.Generator) -> Code | None:
        """The codes of recorded motions as training draws and conditions them; None for generators without any.

        A generator with several codes a motion gives their means, in whatever widths they have.
        """
        return None

    def conclude(self, batches: Iterable[MotionBatch]) -> None:
        """Called once when training is over, with every training clip once; most generators need nothing of it.

        `batches` can be gone through several times and lie on any device.
        """
