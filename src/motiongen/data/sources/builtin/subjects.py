"""The people of the corpus: their bodies and the ways in which they move them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motiongen.data.sources.builtin.body import Body


@dataclass(frozen=True)
class Subject:
    """How a person moves. Angles in degrees, lengths in metres; factors are about 1."""

    name: str
    tempo: float
    amplitude: float
    right_handed: bool
    slouch: float
    """Forward bend of the spine at rest."""
    arm_carry: float
    """Abduction of the hanging arms."""
    elbow_carry: float
    stance_width: float
    """Of one foot from the middle line."""
    toe_out: float
    stride: float
    sway: float
    bounce: float
    knee_bend: float
    """How far the pelvis hangs below straight legs."""
    stiffness: float
    """Share of the shoulders' counter-rotation that is lost."""
    restless: float
    chin: float
    """Bend of the head at rest, positive looks down."""
    body: Body


def cast(seed: int, count: int, body_spread: float = 0.0) -> tuple[Subject, ...]:
    """Draw `count` people; every fourth is left-handed.

    Tempo, amplitude, posture and body are stratified, so that a small cast still spans them.

    Args:
        seed: of the draw.
        count: of people.
        body_spread: the share by which the longest and the shortest differ from the mean body, in stature and in the
            proportions of trunk, shoulders and arms. The way in which people move does not depend on it.
    """
    generator = np.random.default_rng([seed, 1])

    def spread(low: float, high: float) -> list[float]:
        places = (generator.permutation(count) + generator.uniform(0.1, 0.9, count)) / count
        return [float(value) for value in low + (high - low) * places]

    traits = {
        "tempo": spread(0.86, 1.16),
        "amplitude": spread(0.80, 1.18),
        "slouch": spread(-2.0, 13.0),
        "arm_carry": spread(4.0, 13.0),
        "elbow_carry": spread(8.0, 24.0),
        "stance_width": spread(0.075, 0.115),
        "toe_out": spread(2.0, 13.0),
        "stride": spread(0.86, 1.12),
        "sway": spread(0.7, 1.3),
        "bounce": spread(0.7, 1.3),
        "knee_bend": spread(0.002, 0.010),
        "stiffness": spread(0.0, 0.5),
        "restless": spread(0.6, 1.4),
        "chin": spread(-3.0, 6.0),
    }
    shapes = [spread(1 - body_spread, 1 + body_spread) for _ in range(4)]
    return tuple(
        Subject(
            name=f"subject_{index:02d}",
            right_handed=index % 4 != 3,
            body=Body(*(shape[index] for shape in shapes)),
            **{trait: values[index] for trait, values in traits.items()},
        )
        for index in range(count)
    )
