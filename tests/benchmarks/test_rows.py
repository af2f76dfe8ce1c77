"""Every row runs on tiny sizes; a row compares our result with the reference's itself, and raises if they differ."""

from __future__ import annotations

import importlib
import shutil
import subprocess
import sys
from collections.abc import Callable

import pytest
import torch

from benchmarks import report
from benchmarks.measuring import Effort, Timing, floor, interleaved, operations, peak_mebibytes, slope
from benchmarks.results import Comparison, Figure, InexactError
from benchmarks.rows import ROWS
from motiongen.generation.packed import packed_linear

QUICK = Effort(quick=True)
ALONE = {"training_input", "command_line", "lengths", "data_size", "long_motion", "evaluation_set", "profiles"}
"""Rows without a reference."""
COMPILED = {"vertex_loss", "kinematics"}
"""Rows one way of which is compiled."""


@pytest.mark.parametrize("name", ROWS)
def test_a_row_runs_and_is_exact(name: str) -> None:
    if name in COMPILED and shutil.which("g++") is None:
        pytest.skip("torch.compile needs a C++ compiler, and there is no g++")
    row = importlib.import_module(f"benchmarks.rows.{name}")
    results = row.measure(QUICK)
    assert len({result.name for result in results}) == len(results)
    assert any(isinstance(result, Comparison) for result in results) == (name not in ALONE)
    for result in results:
        assert all(value == value for value in result.metrics().values()), result.name
    assert f"## {row.TITLE}" in report.section(row, results)


def test_a_wrong_result_is_refused() -> None:
    timing = Timing((1.0, 1.0))
    with pytest.raises(InexactError, match="off by"):
        Comparison("fast and wrong", timing, timing, error=1e-2, tolerance=1e-3)
    with pytest.raises(InexactError):
        Comparison("not a number", timing, timing, error=float("nan"), tolerance=1e-3)


def test_ratios_are_taken_round_by_round() -> None:
    # A disturbance of one round slows both, and leaves the ratio alone.
    ratio = Timing((4.0, 40.0, 4.0)).over(Timing((2.0, 20.0, 2.0)))
    assert ratio.samples == (2.0, 2.0, 2.0)


def test_ways_are_called_in_turn() -> None:
    calls: list[str] = []
    taken = interleaved({name: lambda name=name: calls.append(name) for name in "ab"}, Effort(rounds=3))
    assert calls == ["a", "b", "a", "b", "b", "a", "a", "b"]
    assert all(len(timing.samples) == 3 for timing in taken.values())


def test_operations_of_products_and_attention() -> None:
    one, other = torch.randn(3, 5), torch.randn(5, 7)
    assert operations(lambda: one @ other) == 2 * 3 * 5 * 7
    with torch.inference_mode():
        linear = packed_linear(torch.randn(7, 5), torch.zeros(7), rows=3)
        assert operations(lambda: linear(one)) == 2 * 3 * 5 * 7
    heads = torch.randn(2, 4, 10, 16)
    assert operations(lambda: torch.nn.functional.scaled_dot_product_attention(heads, heads, heads)) == (
        2 * 2 * 2 * 4 * 10 * 10 * 16
    )
    assert floor(lambda: one @ other, QUICK) > 0


def test_memory_of_a_fresh_process() -> None:
    assert 64 <= peak_mebibytes(Effort(), zeros, 16 * 2**20) < 80


def zeros(count: int) -> Callable[[], object]:
    return lambda: torch.zeros(count).add_(1)


def test_slope_of_a_power() -> None:
    assert slope([1, 10, 100], [2.0, 200.0, 20000.0]) == pytest.approx(2.0)


def test_page_holds_machine_and_sections() -> None:
    page = report.page({"cores": "2"}, ["## One", "## Two"])
    assert "| cores" in page
    assert "## One\n\n## Two" in page


def test_unknown_rows_are_named() -> None:
    found = subprocess.run([sys.executable, "-m", "benchmarks", "generatoin"], capture_output=True, text=True)
    assert found.returncode == 2
    assert "there is no row generatoin" in found.stderr


def test_figures_keep_their_target() -> None:
    row = importlib.import_module("benchmarks.rows.command_line")
    assert "under 1 s" in report.section(row, [Figure("--help", 0.4, "s", "under 1 s")])
