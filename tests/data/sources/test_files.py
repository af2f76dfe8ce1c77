from __future__ import annotations

import math

import numpy as np
import pytest

from motiongen.data.sources.files import read_numbers


def test_numbers_are_those_that_were_written_however_they_are_spaced():
    values = np.random.default_rng(0).standard_normal((50, 7)) * 10.0 ** np.arange(-3, 4)
    rows = ["\t ".join(repr(float(value)) for value in row) + "  " for row in values]
    np.testing.assert_array_equal(read_numbers([" " + row for row in rows]), values)


def test_all_ways_to_write_a_number():
    assert read_numbers(["+1 -.5 1E+05 7. 1e-3"]).tolist() == [[1.0, -0.5, 1e5, 7.0, 1e-3]]
    assert read_numbers(["inf -inf"]).tolist() == [[math.inf, -math.inf]]


@pytest.mark.parametrize(
    "damaged", ["3", "3 4 5", "", "3 x", "3 1e", "3 1-2", '"3" 4', "3 0x10", "3 NA", "3 1\x005", "#3 4"]
)
def test_what_is_no_table_of_numbers_is_refused(damaged: str):
    with pytest.raises(ValueError, match=r"convert|Expected"):
        read_numbers(["1 2", damaged, "5 6"])
