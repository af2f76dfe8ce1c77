from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motiongen.data.sources.numbers import read_numbers

FORMS = ("{:.6f}", "{:g}", "{:.17g}", "{:.0f}", "{:.1e}", "{:+.3f}", "{:.8f}", "{:.9f}", "{:e}")
NUMBERS = st.floats(-1e9, 1e9) | st.floats(-1e-4, 1e-4) | st.integers(-400, 400).map(float) | st.just(-0.0)
WORDS = st.builds(str.format, st.sampled_from(FORMS), NUMBERS)
"""Numbers as programs write them."""
# fmt: off
ODD = (
    "5.", ".5", "-.5", "0e-05", "1e-9", "3.2e-014", "1e-15", "2.5e-22", "99999999.5", "123456789", "1E-05",
    "nan", "-inf",
)
NO_NUMBERS = (
    "x", "-", ".", "-.", "+", "1.2.3", "1-2", "--1", "e-05", "1e-", "1e-x5",
    "1e-05e-05", "1e.5", "1_000", "0x1p3", "1,5", "1:", "1/", "²", "\u0661", "\0", "1\x7f",
)
# fmt: on


def same(lines: list[str]) -> None:
    found, expected = read_numbers(lines), np.loadtxt(lines, ndmin=2, comments=None)
    assert found.dtype == expected.dtype
    assert found.tobytes() == expected.tobytes()
    assert found.shape == expected.shape


@given(st.lists(st.lists(WORDS | st.sampled_from(ODD), min_size=3, max_size=3), min_size=1, max_size=4), st.data())
def test_every_bit_is_as_numpy_reads_it(rows: list[list[str]], data: st.DataObject) -> None:
    blank = st.sampled_from((" ", "\t", "  ", " \t "))
    same(["".join(word + data.draw(blank) for word in row) for row in rows])


def test_every_bit_of_many_numbers() -> None:
    """Written with all numbers of decimals, so that all roundings of the last bit are met."""
    rng = np.random.default_rng(0)
    values = rng.uniform(-1, 1, (2000, 9)) * 10.0 ** rng.integers(-6, 8, (2000, 9))
    same([" ".join(f"{value:.{place}f}" for place, value in enumerate(row)) for row in values])
    same([" ".join(f"{value / 1e6:.{place}e}" for place, value in enumerate(row)) for row in values])


@pytest.mark.parametrize("word", ODD)
def test_odd_words_alone(word: str) -> None:
    same([f" {word}"])


@pytest.mark.parametrize("blank", ["\v", "\f", "\x1c", "\xa0", "\u3000"])
def test_other_blanks_are_those_of_numpy(blank: str) -> None:
    same([f"1.5{blank}2", f"3{blank}4e-3"])


@pytest.mark.parametrize("word", NO_NUMBERS)
@pytest.mark.parametrize("row", ["{}", "1.5 {} 2", "1 2.25 {}"])
def test_what_is_no_number_is_refused(word: str, row: str) -> None:
    with pytest.raises(ValueError, match=r"convert|lengths|columns"):
        read_numbers([row.format(word)])


@pytest.mark.parametrize(
    "lines", [[], [""], ["1 2", ""], ["", "1 2"], ["1 2", "3"], ["1", "2 3"], ["1 2", "3 4 5", "6"]]
)
def test_lines_of_other_lengths_are_refused(lines: list[str]) -> None:
    with pytest.raises(ValueError, match="lengths"):
        read_numbers(lines)
