"""The hierarchical recurrent VAE (Ghorbani et al. 2020)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from motiongen.contracts import (
    Code,
    CompositionError,
    Condition,
    Dimensions,
    GeneratorModule,
    MotionBatch,
    PoseForm,
    Posterior,
    Prediction,
)
from motiongen.generation.pooling import masked_mean
from motiongen.generation.pose_forms import RotationForm
from motiongen.objectives.terms import kl_divergence, mean_over_frames
from motiongen.options import PositiveInt
from motiongen_plugins.hierarchical_rvae.attributes import AttributeClassifiers, InitialState
from motiongen_plugins.hierarchical_rvae.parts import Cell, Denoiser, WordCoder
from motiongen_plugins.hierarchical_rvae.root_velocity import RootVelocity, root_distance


@dataclass(frozen=True)
class Course:
    """What the cell made of a motion's words, one after another."""

    latents: Tensor
    """(B, N, D)"""
    words: Tensor
    """(B, N, W)"""
    divergence: Tensor
    """(B, N): KL of each posterior to its prior"""


class HierarchicalRvae(GeneratorModule):
    """Poses to motion words, words through a motion cell with a latent at every step, words back to poses.

    Reads tags, styles and length of a condition. Its own loss terms: `kl` of posterior to prior, each word's
    spread over its frames, so that it weighs the same against the reconstruction whatever the length of words; `root`
    and `valid_rotations`; `classifier` (Eq. 24); `auxiliary`, by which classifiers and denoiser learn from recorded
    motion.

    Args:
        features: F, numbers of a pose in 6D form, as batches and predictions have it.
        tags: A, actions.
        initial_frames: K; the initial motion is not read.
        styles: S, may be 0.
        attribute_width: D_a, features of tags and style.
        pose: from F to the form of the joints' rotations; the root has a form of its own.
        words: from P, numbers of a pose in these forms, to a word coder.
        cell: from the width of words, D_a and the words' activation to a motion cell.
        dropping: progress of the run -> share of words after which the cell goes on from its own output.
        classifier: from P and the number of classes to a module from poses and mask to logits and the features of its
            layers; one is made for tags and one for styles.
        denoiser: from P to a denoiser of the motion that words are read from.

    Raises:
        CompositionError: a pose form that is none of rotations, such as the 6D form, which is the data's own.
    """

    def __init__(
        self,
        *,
        features: int,
        tags: int,
        initial_frames: int,
        styles: int = 0,
        attribute_width: PositiveInt,
        pose: Callable[[int], PoseForm],
        words: Callable[[int], WordCoder],
        cell: Callable[[int, int, nn.Module], Cell],
        dropping: Callable[[float], float],
        classifier: Callable[[int, int], nn.Module],
        denoiser: Callable[[int], Denoiser],
    ) -> None:
        super().__init__()
        form = pose(features)
        if not isinstance(form, RotationForm):
            raise CompositionError(
                f"the hierarchical RVAE has no rotations in the form {type(form).__name__}; choose "
                "generator/pose=quaternion, axis_angle or matrix"
            )
        self.pose = RootVelocity(form)
        self.words = words(self.pose.width)
        self.cell = cell(self.words.width, attribute_width, self.words.output)
        self.attributes = nn.Linear(tags + styles, attribute_width)
        self.initial_state = InitialState(tags, styles, self.cell.state_width)
        sizes = {"tags": tags, "styles": styles}
        self.classifiers = AttributeClassifiers(
            {n: classifier(self.pose.width, size) for n, size in sizes.items() if size}
        )
        self.denoiser = denoiser(self.pose.width)
        self.dropping = dropping
        self.dimensions = Dimensions(features, tags, initial_frames, self.words.width, styles)
        self.apply(kaiming)

    def reconstruct(self, batch: MotionBatch, progress: float, generator: torch.Generator) -> Prediction:
        poses, mask = self._whole_words(batch)
        judged = self.classifiers(poses, mask)
        condition = self.classifiers.completed(batch.condition, judged)
        words = self.words.encode(self.denoiser.clean(poses, mask, progress))
        course = self._follow(words, condition, self.dropping(progress), generator)
        raw = self.words.decode(course.words)
        remade = self.pose.normalize(raw)
        terms = {
            "kl": mean_over_frames(
                course.divergence.repeat_interleave(self.words.frames, dim=1) / self.words.frames, mask
            ),
            "root": mean_over_frames(root_distance(remade, poses), mask),
            "valid_rotations": mean_over_frames(self.pose.violation(raw), mask),
            "classifier": self.classifiers.disagreement(remade, mask, condition, judged),
            "auxiliary": self.classifiers.loss(batch.condition, judged) + self.denoiser.loss(poses, mask, generator),
        }
        return Prediction(self.pose.decode(remade)[:, : batch.motion.shape[1]], terms=terms)

    def code(self, batch: MotionBatch, generator: torch.Generator) -> Code:
        """Means over a motion's words: of their latents and, as what the condition made of them, the decoded words."""
        poses, mask = self._whole_words(batch)
        words = self.words.encode(self.denoiser.clean(poses, mask, 1.0))
        course = self._follow(words, batch.condition, 0.0, generator)
        valid = mask[:, :: self.words.frames]
        return Code(masked_mean(course.latents, valid), masked_mean(course.words, valid))

    @property
    def reads(self) -> frozenset[str]:
        return frozenset({"tags", "styles", "mask"})

    def generate(self, condition: Condition, seed: int) -> Tensor:
        generator = torch.Generator().manual_seed(seed)
        frames = condition.mask.shape[1]
        words = []
        with torch.inference_mode():
            attributes = self.attributes(torch.cat([condition.tags, condition.styles], dim=1))
            state = self.initial_state(condition).sample(generator)
            for _ in range(0, frames, self.words.frames):
                step = self.cell.sample(attributes, state, generator)
                words.append(step.word)
                state = step.state
            poses = self.pose.normalize(self.words.decode(torch.stack(words, dim=1)))
            return self.pose.decode(poses)[:, :frames] * condition.mask.unsqueeze(-1)

    def _follow(self, words: Tensor, condition: Condition, ratio: float, generator: torch.Generator) -> Course:
        """Words (B, N, W) through the cell; with the share `ratio` it goes on from its own."""
        attributes = self.attributes(torch.cat([condition.tags, condition.styles], dim=1))
        state = self.initial_state(condition).sample(generator)
        steps, posteriors, states = [], [], []
        for word in words.unbind(dim=1):
            dropped = (torch.rand(len(word), 1, generator=generator) < ratio).to(word.device)
            states.append(state)
            step, posterior = self.cell(word, attributes, state, dropped, generator)
            steps.append(step)
            posteriors.append(posterior)
            state = step.state
        prior = self.cell.prior(torch.stack(states, dim=1), attributes.unsqueeze(1).expand(-1, len(states), -1))
        posterior = Posterior(
            torch.stack([one.mean for one in posteriors], dim=1),
            torch.stack([one.log_variance for one in posteriors], dim=1),
        )
        return Course(
            latents=torch.stack([step.latent for step in steps], dim=1),
            words=torch.stack([step.word for step in steps], dim=1),
            divergence=kl_divergence(posterior, prior),
        )

    def _whole_words(self, batch: MotionBatch) -> tuple[Tensor, Tensor]:
        """Poses (B, N l, P), and which of them are the motion's, (B, N l); its last pose is held to the words' end."""
        frames = batch.motion.shape[1]
        place = torch.arange(-(-frames // self.words.frames) * self.words.frames, device=batch.motion.device)
        lengths = batch.condition.lengths.unsqueeze(1)
        held = torch.minimum(place, lengths - 1).unsqueeze(-1).expand(-1, -1, batch.motion.shape[2])
        return self.pose.encode(batch.motion.gather(1, held)), place < lengths


def kaiming(module: nn.Module) -> None:
    """Kaiming initialisation of a layer's weights (section 4.2), biases at zero."""
    layers = (nn.Linear, nn.Conv1d, nn.ConvTranspose1d, nn.GRUCell)
    for name, parameter in module.named_parameters(recurse=False) if isinstance(module, layers) else ():
        if name.startswith("weight"):
            nn.init.kaiming_normal_(parameter)
        else:
            nn.init.zeros_(parameter)
