"""Which of several motions of one timeline shows its actions best."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import torch
from torch import Tensor
from torch.nn.utils.rnn import pad_sequence

from motiongen.recognition.recognizer import Recognizer
from motiongen.synthesis.pipeline import LongMotion, Step, canonical_parts


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
    spans = zip(steps, motion.boundaries, motion.boundaries[1:], strict=False)
    for action, (step, start, stop) in enumerate(spans):
        for part in canonical_parts(motion.features[start - 1], motion.features[start:stop], longest):
            yield part, step.tags, action
