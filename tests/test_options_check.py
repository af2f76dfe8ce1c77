from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from omegaconf import OmegaConf

from motiongen.options_check import problems_in

SOURCE = """
from __future__ import annotations
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, Optional
from motiongen.options import NonNegativeFloat, PositiveFloat, PositiveInt, Share
class Stage:
    def __init__(
        self, dimensions, *, count: int = 1, rate: float = 0.1, flag: bool = True, name: str = "a",
        layers: PositiveInt = 1, share: Share = 0.5, weight: NonNegativeFloat = 0.0, step: PositiveFloat = 1.0,
        kind: Literal["gru", "lstm"] = "gru", limit: float | None = None, root: Path = Path(),
        many: Sequence[int] = (), table: Mapping[str, float] = {}, old: Optional[int] = None, quoted: "int" = 1,
        free: Any = None, model: Stage | None = None,
    ): ...
class Whole:
    def __init__(self, *, width: int, depth: int = 1): ...
"""


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    name = f"stages_{abs(hash(str(tmp_path)))}"
    (tmp_path / f"{name}.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(str(tmp_path))
    return name


def problems(node: dict[str, Any]) -> list[str]:
    return problems_in(OmegaConf.create({"stage": node}), ["stage"])


GOOD = [
    {"count": 3},
    {"rate": 1},
    {"rate": 0.5},
    {"flag": False},
    {"name": "b"},
    {"layers": 1},
    {"share": 1.0},
    {"share": 0},
    {"weight": 0.0},
    {"step": 1e-9},
    {"kind": "lstm"},
    {"limit": None},
    {"limit": 3.5},
    {"root": "data"},
    {"many": [1, 2]},
    {"table": {"a": 1.0}},
    {"old": None},
    {"quoted": 2},
    {"free": "anything"},
    {"model": None},
]
BAD = [
    ({"count": 1.5}, "a whole number"),
    ({"count": "1"}, "a whole number"),
    ({"count": True}, "a whole number"),
    ({"count": None}, "a whole number"),
    ({"rate": "fast"}, "a number"),
    ({"flag": 1}, "true or false"),
    ({"name": 3}, "text"),
    ({"layers": 0}, "a whole number of at least 1"),
    ({"share": 1.01}, "a number from 0 to 1"),
    ({"weight": -1}, "a number of at least 0"),
    ({"step": 0}, "a number above 0"),
    ({"kind": "rnn"}, "'gru', 'lstm'"),
    ({"limit": "none"}, "a number or null"),
    ({"many": 3}, "a list, each item a whole number"),
    ({"many": [3, "x"]}, "a list, each item a whole number"),
    ({"table": [1]}, "a set of key: value"),
    ({"old": "x"}, "a whole number or null"),
    ({"quoted": "x"}, "a whole number"),
]


@pytest.mark.parametrize("options", GOOD)
def test_values_that_fit(module: str, options: dict[str, Any]) -> None:
    assert problems({"_target_": f"{module}.Stage", "_partial_": True, **options}) == []


@pytest.mark.parametrize(("options", "expected"), BAD)
def test_values_that_do_not_fit(module: str, options: dict[str, Any], expected: str) -> None:
    (name, value), *_ = options.items()
    told = problems({"_target_": f"{module}.Stage", "_partial_": True, **options})
    assert told == [f"stage.{name}={OmegaConf.create(options)[name]}: Stage takes {expected}"]
    assert str(value) in told[0] or not isinstance(value, int | float | str)


def test_a_complete_call_needs_what_has_no_default(module: str) -> None:
    assert problems({"_target_": f"{module}.Whole"}) == ["stage.width must be given: Whole needs it"]
    assert problems({"_target_": f"{module}.Whole", "_partial_": True}) == []


def test_what_code_supplies_to_a_partial_is_not_suggested(module: str) -> None:
    (told,) = problems({"_target_": f"{module}.Stage", "_partial_": True, "nmae": "x"})
    assert "did you mean 'name'?" in told
    assert "dimensions" not in told


def test_nested_targets_are_checked_where_they_are(module: str) -> None:
    inner = {"_target_": f"{module}.Whole", "width": "x"}
    told = problems({"a": {"b": inner}, "c": [{"_target_": f"{module}.Whole", "width": 1, "deep": 1}]})
    assert told[0].startswith("stage.a.b.width=x")
    assert told[1].startswith("stage.c[0].deep")


def test_values_that_are_missing_or_point_nowhere(module: str) -> None:
    assert problems({"a": "???"}) == ["stage.a must be given: stage.a=..."]
    (told,) = problems({"_target_": f"{module}.Whole", "width": "${nowhere}"})
    assert told.startswith("stage.width: ")
    assert "nowhere" in told


def test_sections_that_a_task_does_not_read_are_not_checked() -> None:
    config = OmegaConf.create({"read": {"a": 1}, "unread": {"a": "???"}})
    assert problems_in(config, ["read"]) == []
