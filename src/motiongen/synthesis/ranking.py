"""Which of several motions of one timeline shows its actions best."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import torch
from torch import Tensor
from torch.nn.utils.rnn import pad_sequence

from motiongen.data.clips import INITIAL_FRAMES
from motiongen.motion.canonical import GroundFrame
from motiongen.recognition.recognizer import Recognizer
from motiongen.synthesis.pipeline import LongMotion, Step, equal_parts


def recognized(motion: LongMotion, steps: Sequence[Step], recognizer: Recognizer, longest: int) -> float:
    """How sure a recognizer is of the actions: mean over them of the log-probability of their tags, at most 0.

    Actions longer than `longest` frames, the windows that the recognizer knows, are judged in equal parts.
    """
    pieces, tags, actions = zip(*_pieces(motion, steps, longest), strict=True)
    device = next(recognizer.parameters()).device
    lengths = torch.tensor([len(piece) for piece in pieces])
    mask = torch.arange(int(lengths.max())) < lengths[:, None]
    with torch.inference_mode():
        seen = recognizer(pad_sequence(list(pieces), batch_first=True).to(device), mask.to(device))
    log = seen.logits.log_softmax(dim=-1).cpu()
    sure = log.masked_fill(torch.stack(tags) == 0, -torch.inf).logsumexp(dim=-1)
    return float(torch.stack([sure[torch.tensor(actions) == action].mean() for action in set(actions)]).mean())


def _pieces(motion: LongMotion, steps: Sequence[Step], longest: int) -> Iterator[tuple[Tensor, Tensor, int]]:
    """(canonical frames, tags, number of the action) for every action, or part of one."""
    for action, (step, first) in enumerate(zip(steps, motion.boundaries, strict=False)):
        for length in equal_parts(step.frames, longest):
            window = motion.features[first - INITIAL_FRAMES : first + length]
            frame = GroundFrame.of(window[INITIAL_FRAMES - 1])
            yield frame.enter(window)[INITIAL_FRAMES:], step.tags, action
            first += length
