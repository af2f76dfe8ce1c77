from __future__ import annotations

import pytest

from motiongen.generation.schedules import LinearRamp


def test_ramp_rises_linearly_between_its_ends():
    ramp = LinearRamp(0.25, 0.75)
    assert [ramp(x) for x in (0.0, 0.25, 0.5, 0.625, 0.75, 1.0)] == [0.0, 0.0, 0.5, 0.75, 1.0, 1.0]


def test_ramp_of_no_length_is_a_step():
    assert (LinearRamp(0.5, 0.5)(0.49), LinearRamp(0.5, 0.5)(0.5)) == (0.0, 1.0)


@pytest.mark.parametrize(("start", "end"), [(-0.1, 0.5), (0.6, 0.5), (0.5, 1.1)])
def test_ramp_outside_the_run_is_refused(start, end):
    with pytest.raises(ValueError, match="0 <= start <= end <= 1"):
        LinearRamp(start, end)
