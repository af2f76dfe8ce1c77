"""The rows' results as tables, and the page that is made of them."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from types import ModuleType

from benchmarks.measuring import Timing
from benchmarks.results import Comparison, Figure, Result
from motiongen.evaluation.table import markdown

PAGE = Path(__file__).with_name("page.md")


def section(row: ModuleType, results: Sequence[Result]) -> str:
    """Heading, what is compared, and one table for comparisons and one for figures."""
    comparisons = [_compared(one) for one in results if isinstance(one, Comparison)]
    figures = [_figure(one) for one in results if isinstance(one, Figure)]
    tables = [markdown(rows) for rows in (comparisons, figures) if rows]
    return "\n\n".join([f"## {row.TITLE}", inspect.cleandoc(row.__doc__ or ""), *tables])


def page(machine: Mapping[str, str], sections: Sequence[str]) -> str:
    """The whole page; nothing in its template was measured."""
    about = markdown([{"machine": name, "": value} for name, value in machine.items()])
    return Template(PAGE.read_text(encoding="utf-8")).substitute(machine=about, sections="\n\n".join(sections))


def _compared(one: Comparison) -> dict[str, str]:
    ratio = one.ratio
    low, high = ratio.quartiles
    rates = "-"
    if one.made is not None:
        rates = f"{one.made[0] / one.ours.median:,.0f} {one.made[1]}/s"
        rates += f" (target {one.target_rate:,.0f})" if one.target_rate else ""
    return {
        "": one.name,
        "times faster": f"{ratio.median:.1f} ({low:.1f}-{high:.1f})",
        "target": f"{one.target:g}" if one.target else "-",
        "of target": f"{100 * ratio.median / one.target:.0f} %" if one.target else "-",
        "ours": _time(one.ours),
        "reference": _time(one.reference),
        "floor": _seconds(one.floor) if one.floor else "-",
        "times the floor": f"{one.ours.median / one.floor:.1f}" if one.floor else "-",
        "rate": rates,
        "error": f"{one.error:.0e}",
        "rounds": str(len(one.ours.samples)),
    }


def _figure(one: Figure) -> dict[str, str]:
    return {"": one.name, "measured": f"{_number(one.value)} {one.unit}".strip(), "target": one.target or "-"}


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def _time(timing: Timing) -> str:
    low, high = timing.quartiles
    return f"{_seconds(timing.median)} ({_seconds(low)}-{_seconds(high)})"


def _seconds(value: float) -> str:
    return f"{value:.2f} s" if value >= 1 else f"{1e3 * value:.3g} ms"
