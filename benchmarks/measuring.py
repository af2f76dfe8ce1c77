"""Time side by side, memory in a process of its own, and what this machine could do at most."""

from __future__ import annotations

import math
import multiprocessing
import os
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch.utils.flop_counter import FlopCounterMode, sdpa_backward_flop_count, sdpa_flop_count

LONG = 5.0
"""Seconds from which on a first call needs no warm-up: what is done once does not show in it."""
REST = 0.2
"""Seconds before every call of a comparison: threads of the last one go on waiting for work for a while, and would take
the cores from this one's."""
# torch's own table has the operators of GPUs alone. Its functions are called with shapes in place of tensors.
CPU_OPERATORS = {
    torch.ops.aten._scaled_dot_product_flash_attention_for_cpu: lambda *given, **_: sdpa_flop_count(*given[:3]),
    torch.ops.aten._scaled_dot_product_flash_attention_for_cpu_backward: lambda *given, **_: sdpa_backward_flop_count(
        *given[:4]
    ),
}
if hasattr(torch.ops.mkldnn, "_linear_pointwise"):
    CPU_OPERATORS[torch.ops.mkldnn._linear_pointwise] = lambda x, weight, *_, **__: 2 * math.prod(x) * weight[0]
MULTIPLICATION = 2048
"""Rows and columns of the matrices whose product gives the rate of the machine."""

READING = 2**27
"""Numbers whose sum gives the rate of reading: far more than caches hold."""


@dataclass(frozen=True)
class Effort:
    """How much is measured."""

    quick: bool = False
    """Tiny sizes, two rounds: shows that everything runs, and measures nothing."""
    rounds: int = 9
    """At most so many calls of every way."""
    budget: float = 8.0
    """Seconds after which a comparison begins no other round, once it has two."""

    def size(self, full: int, tiny: int) -> int:
        return tiny if self.quick else full


@dataclass(frozen=True)
class Timing:
    """The seconds of several calls, in the order in which they were made."""

    samples: tuple[float, ...]

    @property
    def median(self) -> float:
        return float(np.median(self.samples))

    @property
    def quartiles(self) -> tuple[float, float]:
        low, high = np.quantile(self.samples, (0.25, 0.75))
        return float(low), float(high)

    def over(self, other: Timing) -> Timing:
        """How many times longer this took, round by round."""
        return Timing(tuple(mine / its for mine, its in zip(self.samples, other.samples, strict=True)))


def interleaved(ways: Mapping[str, Callable[[], object]], effort: Effort) -> dict[str, Timing]:
    """Call every way once a round, in an order that turns with the rounds, so that all meet the same disturbances.

    First calls are warm-up, unless they are `LONG`.
    """
    rounds = 2 if effort.quick else effort.rounds
    names = list(ways)
    rest = 0.0 if effort.quick else REST
    first = {name: _seconds(ways[name], rest) for name in names}
    taken: dict[str, list[float]] = {name: [] for name in names}
    if max(first.values()) > LONG:
        taken = {name: [seconds] for name, seconds in first.items()}
    spent = sum(map(sum, taken.values()))
    for number in range(len(taken[names[0]]), rounds):
        if number >= 2 and spent > effort.budget:
            break
        turn = number % len(names)
        for name in names[turn:] + names[:turn]:
            taken[name].append(_seconds(ways[name], rest))
            spent += taken[name][-1]
    return {name: Timing(tuple(seconds)) for name, seconds in taken.items()}


def _seconds(action: Callable[[], object], rest: float = 0.0) -> float:
    time.sleep(rest)
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


@cache
def multiplication_rate(dtype: torch.dtype, quick: bool) -> float:
    """Floating point operations a second in the product of two large matrices: the best of eight."""
    size = 64 if quick else MULTIPLICATION
    one, other = torch.randn(2, size, size).to(dtype)
    return 2 * size**3 / min(_seconds(lambda: one @ other) for _ in range(9))


@cache
def reading_rate(quick: bool) -> float:
    """Bytes a second of numbers that are in no cache: the best of eight."""
    numbers = torch.ones(1024 if quick else READING)
    return numbers.nbytes / min(_seconds(numbers.sum) for _ in range(9))


def operations(action: Callable[[], object]) -> int:
    """Floating point operations of the matrix products and attentions in a call."""
    with FlopCounterMode(display=False, custom_mapping=CPU_OPERATORS) as counter:
        action()
    return counter.get_total_flops()


def floor(action: Callable[[], object], effort: Effort, dtype: torch.dtype = torch.float32) -> float:
    """Seconds in which this machine could do the matrix products of a call, and nothing else."""
    return operations(action) / multiplication_rate(dtype, effort.quick)


def peak_mebibytes(effort: Effort, function: Callable[..., Callable[[], object]], *arguments: object) -> float:
    """What a call in a fresh process (in this one if `quick`) needs at its peak, above what was held when it began.

    Args:
        effort: how much is measured.
        function: at the top of a module, so that it can be named to the process; it returns the call to be measured.
        arguments: its own.
    """
    if effort.quick:
        return _growth(function, arguments)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_growth, (function, arguments))


def _growth(function: Callable[..., Callable[[], object]], arguments: tuple[Any, ...]) -> float:
    action = function(*arguments)
    before = _status("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak of what came before
    action()
    return (_status("VmHWM") - before) / 1024


def _status(field: str) -> int:
    """Kibibytes. Not `ru_maxrss`, which a process inherits from its parent."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(f"{field}:"))


def slope(sizes: list[int], seconds: list[float]) -> float:
    """The exponent p of cost ~ size^p, by least squares over the logarithms."""
    return float(np.polyfit([math.log(size) for size in sizes], [math.log(taken) for taken in seconds], 1)[0])


def machine(effort: Effort) -> dict[str, str]:
    """What the figures depend on."""
    models = [line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")]
    rates = {dtype: multiplication_rate(dtype, effort.quick) / 1e9 for dtype in (torch.float32, torch.bfloat16)}
    return {
        "processor": models[0].partition(":")[2].strip() if models else platform.processor(),
        "cores": str(os.cpu_count()),
        "threads": str(torch.get_num_threads()),
        "torch": torch.__version__,
        "float32 products": f"{rates[torch.float32]:.0f} GFLOP/s",
        "bfloat16 products": f"{rates[torch.bfloat16]:.0f} GFLOP/s",
        "reading": f"{reading_rate(effort.quick) / 1e9:.0f} GB/s",
        "load before the run": f"{os.getloadavg()[0]:.1f}",
    }
