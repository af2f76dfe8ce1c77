"""What a search varies: Hydra's own sweeps, and bundles of overrides that go together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import ChoiceSweep, IntervalSweep, Override, RangeSweep
from hydra.errors import HydraException

from motiongen.errors import InputError

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution

LOGARITHMIC = "log"
"""`tag(log, interval(1e-4, 1e-2))` is searched on a logarithmic scale."""

Bundles = Mapping[str, Mapping[str, Sequence[str]]]
"""Name of a choice to its options, each of which stands for several overrides."""


class SpaceError(InputError):
    """A search space that cannot be searched."""


class Space:
    """Parameters with their distributions, and the overrides that their values stand for.

    Args:
        sweeps: key or group to a sweep as Hydra's command line takes it: `choice(a, b)`, `range(1, 5)`,
            `interval(0.1, 0.9)`, `tag(log, interval(1e-4, 1e-2))`. Whole numbers are a range.
        bundles: choices whose options stand for several overrides.

    Raises:
        SpaceError: a sweep that cannot be read or that is none, or nothing to search.
    """

    def __init__(self, sweeps: Mapping[str, str], bundles: Bundles) -> None:
        from optuna.distributions import CategoricalDistribution

        self._bundles = bundles
        self.distributions: dict[str, BaseDistribution] = {
            key: _distribution(key, text) for key, text in sweeps.items()
        }
        self.distributions |= {key: CategoricalDistribution(list(options)) for key, options in bundles.items()}
        if not self.distributions:
            raise SpaceError("hydra.sweeper.space: there is nothing to search")

    def overrides(self, values: Mapping[str, Any]) -> list[str]:
        """The command line of a trial, where `values` has one for every parameter."""
        line: list[str] = []
        for key, value in values.items():
            line += self._bundles[key][value] if key in self._bundles else [f"{key}={value}"]
        return line

    def single_choices(self) -> list[list[str]]:
        """Every option of every choice, one at a time: what has to compose before a search starts."""
        lines = [list(line) for options in self._bundles.values() for line in options.values()]
        for key, distribution in self.distributions.items():
            if key not in self._bundles:
                lines += [[f"{key}={value}"] for value in getattr(distribution, "choices", ())]
        return lines


def _distribution(key: str, text: str) -> BaseDistribution:
    from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

    override = _parsed(key, text)
    sweep = override.value()
    if isinstance(sweep, ChoiceSweep):
        return CategoricalDistribution(list(override.sweep_string_iterator()))
    if isinstance(sweep, RangeSweep):
        values = list(sweep.range())
        if all(isinstance(value, int) for value in values):
            return IntDistribution(values[0], values[-1], step=int(sweep.step))
        return FloatDistribution(values[0], values[-1], step=float(sweep.step))
    if isinstance(sweep, IntervalSweep) and sweep.start is not None and sweep.end is not None:
        return FloatDistribution(float(sweep.start), float(sweep.end), log=LOGARITHMIC in sweep.tags)
    raise SpaceError(f"hydra.sweeper.space.{key}={text}: takes choice(...), range(...) or interval(...)")


def _parsed(key: str, text: str) -> Override:
    try:
        return OverridesParser.create().parse_override(f"{key}={text}")
    except HydraException as error:
        raise SpaceError(f"hydra.sweeper.space.{key}={text}: {str(error).splitlines()[0]}") from error
