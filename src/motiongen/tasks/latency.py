"""How long a generator takes for one motion."""

from __future__ import annotations

import time
from collections.abc import Iterable
from statistics import median

from motiongen.contracts import GeneratorModule, MotionBatch

TIMES = 5


def latency(generator: GeneratorModule, batches: Iterable[MotionBatch]) -> float:
    """Milliseconds a frame for one motion alone, the median over a few clips; a first one, which warms up, is left out.

    Args:
        generator: in evaluation mode, on the device that is timed.
        batches: of one clip each.
    """
    seconds = []
    for number, batch in zip(range(TIMES + 1), batches, strict=False):
        start = time.perf_counter()
        generator.generate(batch.condition, seed=number).sum().item()  # waits for the device
        seconds.append((time.perf_counter() - start) / batch.motion.shape[1])
    return 1000 * median(seconds[1:] or seconds)
