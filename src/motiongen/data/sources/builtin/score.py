"""The score of a session: keys in time for every channel of the body, and layers on top of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from motiongen.data.sources.builtin.curves import Array, interpolate, smooth

FPS = 30
SIDES = ("left", "right")
ROOT = ("x", "y", "height", "heading")
TRUNK = (
    "pelvis_pitch",
    "pelvis_roll",
    "pelvis_twist",
    "spine_pitch",
    "spine_roll",
    "spine_twist",
    "head_pitch",
    "head_roll",
    "head_twist",
)
"""Degrees. Pitch bends forward, roll leans right, twist turns left."""
ARM = ("flex", "abduct", "rotate", "elbow", "wrist", "shrug", "reach")
"""Degrees from the hanging arm: flex swings it forward, abduct outward, rotate turns the forearm inward; shrug lifts
and reach advances the collar bone."""
FOOT = ("x", "y", "lift", "yaw", "pitch", "knee", "ground")
"""Place of the middle of the flat foot, height above that, heading, toes up, knee outward, height of the ground."""
CHANNELS = (
    *ROOT,
    *TRUNK,
    *(f"{side}_{channel}" for side in SIDES for channel in ARM),
    *(f"{side}_foot_{channel}" for side in SIDES for channel in FOOT),
)
_LAG = {"spine": 0.02, "head": 0.03, "elbow": 0.025, "wrist": 0.06}
"""Seconds by which a part of the body trails the part that carries it."""


class Score:
    """Keys of all channels, written forward in time: a new key replaces whatever was planned at or after it."""

    def __init__(self, start: Mapping[str, float]) -> None:
        self._times = {channel: [0.0] for channel in CHANNELS}
        self._values = {channel: [float(start[channel])] for channel in CHANNELS}
        self._layers: list[tuple[str, int, Array]] = []

    def key(self, time: float, channel: str, value: float) -> None:
        """Put a key, and drop the keys at or after `time`."""
        times, values = self._times[channel], self._values[channel]
        while times and times[-1] > time - 1e-3:
            times.pop()
            values.pop()
        times.append(time)
        values.append(float(value))

    def last(self, channel: str) -> float:
        """The value that the channel is planned to end at."""
        return self._values[channel][-1]

    def hold(self, time: float) -> None:
        """Keep every channel that has nothing planned after `time` at its last value until then."""
        for channel in CHANNELS:
            if self._times[channel][-1] < time - 1e-3:
                self.key(time, channel, self.last(channel))

    def layer(self, channel: str, first_frame: int, values: Array) -> None:
        """Add a curve to a channel from a frame on."""
        self._layers.append((channel, first_frame, values))

    def read(self, frames: int) -> dict[str, Array]:
        """Every channel at 30 Hz, (frames,) each."""
        time = np.arange(frames) / FPS
        curves = {}
        for channel in CHANNELS:
            lag = next((lag for part, lag in _LAG.items() if part in channel), 0.0)
            keys = np.array(self._times[channel]), np.array(self._values[channel])
            curves[channel] = interpolate(*keys, time - lag)
        for channel, first, values in self._layers:
            stop = min(first + len(values), frames)
            curves[channel][first:stop] += values[: stop - first]
        # Keys give continuous speed; the filter makes acceleration continuous too. Feet get less: a wide filter would
        # spread their steps into the time in which they stand.
        return {channel: smooth(curve, 0.6 if "foot" in channel else 1.2) for channel, curve in curves.items()}
