"""The one protocol through which every figure passes: which clips, which seeds, which recognizer, which settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from motiongen.options import NonNegativeFloat, PositiveInt, Share


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """How a system is judged. Results compare only when their protocols are equal."""

    seeds: PositiveInt = 5
    """How many times every test clip is generated; the intervals are over these."""
    first_seed: int = 0
    """The seeds are first_seed, first_seed + 1, ..."""
    batch_size: PositiveInt = 64
    """Motions generated at once. Part of the protocol, as a generator's noise may depend on the batch."""
    diversity_pairs: PositiveInt = 200
    """S_d of Action2Motion."""
    multimodality_pairs: PositiveInt = 20
    """S_l of Action2Motion."""
    speed_tolerance: Share = 0.3
    """An action's mean joint speed may differ from the real clips' by this share of it."""
    frozen_speed: NonNegativeFloat = 0.05
    """Metres per second: below this mean joint speed a body counts as frozen."""
    manifold_neighbours: PositiveInt = 3
    """k of precision and recall (Kynkäänniemi et al. 2019)."""
    coverage_neighbours: PositiveInt = 5
    """k of density and coverage (Naeem et al. 2020)."""
    bootstrap_draws: PositiveInt = 2000
    """Resampled sets of takes, for intervals over test clips."""
    jackknife_groups: PositiveInt = 20
    """Groups of takes that are left out in turn, for the FID's interval over test clips."""

    lengths: Sequence[PositiveInt] = ()
    """Frames that systems are asked for besides, with accuracy and FID at each; none by default."""

    def to_json(self) -> dict[str, Any]:
        """Plain values. Where no lengths are asked for, nothing of them: the other figures do not depend on them."""
        plain = asdict(self) | {"lengths": list(self.lengths)}
        return plain if self.lengths else {name: value for name, value in plain.items() if name != "lengths"}

    @property
    def generation_seeds(self) -> range:
        """The seeds themselves."""
        return range(self.first_seed, self.first_seed + self.seeds)
