from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from motiongen.data.sources.builtin.curves import ease, interpolate, smooth


def test_interpolation_is_pchip_between_inner_keys() -> None:
    generator = np.random.default_rng(3)
    times = np.cumsum(generator.uniform(0.1, 1.0, 12))
    values = generator.normal(size=12)
    inside = np.linspace(times[1], times[-2], 200)
    expected = PchipInterpolator(times, values)(inside)
    np.testing.assert_allclose(interpolate(times, values, inside), expected, atol=1e-12)


def test_interpolation_rests_between_equal_keys_and_outside() -> None:
    times, values = np.array([0.0, 1.0, 2.0, 3.0]), np.array([5.0, 1.0, 1.0, 4.0])
    np.testing.assert_array_equal(interpolate(times, values, np.linspace(1, 2, 31)), 1.0)
    np.testing.assert_array_equal(interpolate(times, values, np.array([-3.0, 9.0])), [5.0, 4.0])


def test_interpolation_does_not_overshoot() -> None:
    generator = np.random.default_rng(0)
    times, values = np.cumsum(generator.uniform(0.05, 1.0, 40)), generator.normal(size=40)
    at = np.linspace(times[0], times[-1], 2000)
    index = np.clip(np.searchsorted(times, at, side="right") - 1, 0, 38)
    low, high = np.minimum(values[index], values[index + 1]), np.maximum(values[index], values[index + 1])
    curve = interpolate(times, values, at)
    assert (curve >= low - 1e-12).all()
    assert (curve <= high + 1e-12).all()


def test_ease_is_flat_at_its_ends() -> None:
    np.testing.assert_allclose(ease(np.array([-1.0, 2.0, 3.0, 4.0, 9.0]), 2.0, 4.0), [0, 0, 0.5, 1, 1])
    step = 1e-4
    slope = np.diff(ease(np.array([2.0, 2.0 + step, 4.0 - step, 4.0]), 2.0, 4.0)) / step
    assert abs(slope[0]) < 1e-6
    assert abs(slope[2]) < 1e-6


def test_smoothing_keeps_constants_and_the_mean_of_a_line() -> None:
    np.testing.assert_allclose(smooth(np.full(20, 3.0), 1.5), 3.0)
    line = np.arange(40.0)
    np.testing.assert_allclose(smooth(line, 1.0)[6:-6], line[6:-6])
