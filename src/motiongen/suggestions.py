"""The right name for a wrong one."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def did_you_mean(name: str, candidates: Iterable[str]) -> str:
    """`; did you mean 'x'?` with the nearest of the candidates, or nothing where none is near."""
    near = get_close_matches(name, sorted(set(candidates)), n=1, cutoff=0.6)
    return f"; did you mean {near[0]!r}?" if near else ""
