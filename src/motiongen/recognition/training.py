"""Training a recognizer on the training split, and measuring it on the test split."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import torch
from rich.progress import track
from torch import Tensor
from torch.utils.data import DataLoader

from motiongen.contracts import MotionBatch
from motiongen.data.dataset import Item, MotionDataset, bucketed, collate
from motiongen.evaluation.metrics.classification import hits
from motiongen.options import NonNegativeFloat, PositiveFloat, PositiveInt, Share
from motiongen.recognition.augmentation import Augmentation
from motiongen.recognition.recognizer import Recognizer, RecognizerBuilder

if TYPE_CHECKING:
    from motiongen.data.datamodule import MotionData


@dataclass(frozen=True, kw_only=True)
class RecognizerTraining:
    """AdamW under a cosine schedule, on batches and augmentations drawn anew in every epoch."""

    epochs: PositiveInt = 60
    batch_size: PositiveInt = 32
    """Clips in a step: not the generator's batch size, so that all generators are judged by the same recognizer."""
    epoch_steps: PositiveInt = 8
    """Steps in an epoch, at least: a data set of few clips is gone through more than once."""
    learning_rate: PositiveFloat = 1e-3
    warmup: Share = 0.1
    """Share of the run in which the learning rate rises."""
    weight_decay: NonNegativeFloat = 0.05
    label_smoothing: Share = 0.1
    augmentation: Augmentation = field(default_factory=Augmentation)
    seed: int = 0
    """Of weights, dropout, batches and augmentation."""

    def rate(self, progress: float) -> float:
        """Learning rate at `progress` in [0, 1) of the run."""
        rise = min(1.0, progress / self.warmup) if self.warmup else 1.0
        return self.learning_rate * rise * 0.5 * (1 + math.cos(math.pi * progress))


def train(build: RecognizerBuilder, settings: RecognizerTraining, data: MotionData) -> Recognizer:
    """A recognizer trained on `data.split.train`, in eval mode. The same settings and data give the same weights.

    Raises:
        ValueError: the split has a group of sequences on both sides, so that test accuracy would mean nothing.
    """
    check_split(data)
    clips = data.train_items()
    generator = torch.Generator().manual_seed(settings.seed)
    # Initialisation and dropout draw from torch's global generator; the caller's state is put back afterwards.
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(settings.seed)
        recognizer = build(tags=len(data.tags), skeleton=data.skeleton).train()
        optimizer = torch.optim.AdamW(recognizer.parameters(), lr=0.0, weight_decay=settings.weight_decay)
        for epoch in track(range(settings.epochs), "Training the recognizer"):
            batches = epoch_batches(clips, settings, epoch)
            for step, batch in enumerate(batches):
                optimizer.param_groups[0]["lr"] = settings.rate((epoch + step / len(batches)) / settings.epochs)
                motion, mask = settings.augmentation(batch.motion, batch.condition.mask, generator)
                logits = recognizer(motion, mask).logits
                loss = smoothed_cross_entropy(logits, batch.condition.tags, settings.label_smoothing)
                optimizer.zero_grad()
                loss.backward()
                torch.nn.utils.clip_grad_norm_(recognizer.parameters(), 1.0)
                optimizer.step()
    return recognizer.eval()


def epoch_batches(clips: MotionDataset, settings: RecognizerTraining, epoch: int) -> DataLoader[Item]:
    """All clips in batches of similar lengths, shuffled, as often as an epoch needs."""
    order = np.random.default_rng((settings.seed, epoch))
    lengths = [len(clip) for clip in clips.clips]
    batches: list[list[int]] = []
    while len(batches) < settings.epoch_steps:
        batches += bucketed(lengths, settings.batch_size, order)
    return DataLoader(clips, batch_sampler=batches, collate_fn=collate, generator=torch.Generator())


def smoothed_cross_entropy(logits: Tensor, tags: Tensor, smoothing: float) -> Tensor:
    """Mean cross-entropy of logits (B, A) against multi-hot tags (B, A); a clip's tags share its weight equally."""
    target = tags / tags.sum(dim=1, keepdim=True)
    return torch.nn.functional.cross_entropy(logits, target, label_smoothing=smoothing)


@torch.inference_mode()
def recognized_share(recognizer: Recognizer, batches: Iterable[MotionBatch]) -> float:
    """Accuracy of a recognizer in eval mode on real clips, 0 to 1 (see `metrics.classification.accuracy`)."""
    found = [hits(recognizer(batch.motion, batch.condition.mask).logits, batch.condition.tags) for batch in batches]
    return float(torch.cat(found).double().mean())


def check_split(data: MotionData) -> None:
    """Raise ValueError if a group of sequences is on both sides of the split."""
    names = data.store.sequences
    sides = [{names[clip.sequence].group for clip in side} for side in (data.split.train, data.split.test)]
    if shared := sorted(sides[0] & sides[1]):
        raise ValueError(f"training and test split share {len(shared)} groups of sequences, {shared[0]} among them")
