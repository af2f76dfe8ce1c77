"""Curves over time on numpy arrays: interpolation of keys, easing, smoothing, slow noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def interpolate(times: Array, values: Array, at: Array) -> Array:
    """Shape-preserving cubic through keys (Fritsch and Butland 1984, the slopes of PCHIP); constant outside them.

    It is once continuously differentiable, never overshoots a key, and is exactly constant between equal keys, so a
    foot that is keyed twice at one place does not move in between.

    Args:
        times: (N,) strictly increasing seconds.
        values: (N,).
        at: (T,) seconds.
    """
    if len(times) == 1:
        return np.full(len(at), values[0])
    width = np.diff(times)
    slope = np.diff(values) / width
    tangent = np.zeros(len(times))
    if len(times) > 2:
        before, after = slope[:-1], slope[1:]
        weight_before, weight_after = 2 * width[1:] + width[:-1], width[1:] + 2 * width[:-1]
        same_sign = before * after > 0
        safe_before, safe_after = np.where(same_sign, before, 1.0), np.where(same_sign, after, 1.0)
        harmonic = (weight_before + weight_after) / (weight_before / safe_before + weight_after / safe_after)
        tangent[1:-1] = np.where(same_sign, harmonic, 0.0)
    at = np.clip(at, times[0], times[-1])
    index = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    span = width[index]
    u = (at - times[index]) / span
    start = values[index] + u * u * (3 - 2 * u) * (values[index + 1] - values[index])
    return start + span * u * (1 - u) * ((1 - u) * tangent[index] - u * tangent[index + 1])


def ease(x: Array | float, start: float, stop: float) -> Array:
    """Quintic step from 0 at `start` to 1 at `stop`, with zero speed and acceleration at both ends."""
    u = np.clip((np.asarray(x, dtype=np.float64) - start) / (stop - start), 0.0, 1.0)
    return u**3 * (u * (6 * u - 15) + 10)


def smooth(values: Array, sigma: float) -> Array:
    """Gaussian filter along the first axis; the ends are extended by their values. `sigma` in frames."""
    if sigma <= 0:
        return values
    reach = int(np.ceil(4 * sigma))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    padded = np.concatenate([np.repeat(values[:1], reach, 0), values, np.repeat(values[-1:], reach, 0)])
    columns = padded.reshape(len(padded), -1).T
    filtered = np.stack([np.convolve(column, kernel / kernel.sum(), mode="valid") for column in columns], axis=-1)
    return filtered.reshape(values.shape)


def slow_noise(generator: np.random.Generator, times: Array, cycles: tuple[float, float] = (0.15, 0.9)) -> Array:
    """A sum of five sines of random phase between two frequencies (Hz), with about unit standard deviation."""
    frequency = np.exp(generator.uniform(np.log(cycles[0]), np.log(cycles[1]), 5))
    phase = generator.uniform(0, 2 * np.pi, 5)
    noise: Array = np.sin(2 * np.pi * frequency * times[:, None] + phase).sum(axis=1) * np.sqrt(2 / 5)
    return noise
