from __future__ import annotations

import itertools
import math

import pytest
import torch

from motiongen.motion.canonical import GroundFrame
from motiongen.synthesis.paths import (
    Directions,
    DrawnPath,
    PlacedPath,
    RecordedPath,
    cut_line,
    direction,
    fit_bezier,
    fit_path,
    length,
    sample_bezier,
)

HERE = GroundFrame(torch.tensor(math.pi / 2), torch.tensor([3.0, -2.0]))
AHEAD = torch.stack([torch.zeros(4), -torch.arange(1.0, 5)], dim=-1)


def test_a_recorded_path_goes_along_with_the_body():
    expected = torch.stack([3 + torch.arange(1.0, 5), torch.full((4,), -2.0)], dim=-1)
    torch.testing.assert_close(RecordedPath(AHEAD).place(HERE), expected)


def test_a_drawn_path_keeps_its_direction():
    torch.testing.assert_close(DrawnPath(AHEAD).place(HERE), torch.tensor([3.0, -2.0]) + AHEAD)


def test_a_body_beside_a_placed_path_comes_back_to_it():
    start = torch.tensor([1.0, 1.0])
    placed = PlacedPath(start, AHEAD).place(HERE)
    torch.testing.assert_close(placed[-1], start + AHEAD[-1])
    torch.testing.assert_close(placed[0], AHEAD[0] + 0.75 * HERE.origin + 0.25 * start)


def test_bezier_curves_are_fitted_exactly():
    """Points whose parameters are their shares of the way: an arc of even speed."""
    control = torch.tensor([[0.0, 0], [0, -1], [1, -2], [2, -2]], dtype=torch.float64)
    dense = sample_bezier(control, 400)
    dense = torch.cat([control[:1], dense])
    fitted = fit_bezier(dense)
    assert torch.equal(fitted[0], dense[0])
    assert torch.equal(fitted[-1], dense[-1])
    nearest = torch.cdist(sample_bezier(fitted, 100), dense).min(dim=1).values
    assert float(nearest.max()) < 0.01


@pytest.mark.parametrize("count", [2, 3, 4, 9])
def test_a_straight_line_stays_one_at_even_speed(count):
    line = torch.linspace(0, 1, count).unsqueeze(-1) * torch.tensor([[3.0, -4.0]])
    expected = torch.arange(1, 11).unsqueeze(-1) / 10 * torch.tensor([[3.0, -4.0]])
    torch.testing.assert_close(sample_bezier(fit_bezier(line), 10), expected, atol=1e-5, rtol=0)


def test_a_line_is_cut_by_shares_without_a_gap():
    points = torch.tensor([[0.0, 0], [0, -2], [2, -2], [2, 0]])
    pieces = cut_line(points, [1.0, 3.0, 2.0])
    for one, other in itertools.pairwise(pieces):
        assert torch.equal(one[-1], other[0])
    assert torch.equal(pieces[0][0], points[0])
    assert torch.equal(pieces[-1][-1], points[-1])
    ways = [float(piece.diff(dim=0).norm(dim=-1).sum()) for piece in pieces]
    assert [way / sum(ways) for way in ways] == pytest.approx([1 / 6, 1 / 2, 1 / 3], abs=1e-3)
    # It passes the points that were drawn.
    assert float(torch.cdist(points, torch.cat(pieces)).min(dim=1).values.max()) < 1e-5


def test_two_points_are_a_straight_line():
    (piece,) = cut_line(torch.tensor([[1.0, 0], [1, -3]]), [5.0])
    torch.testing.assert_close(piece[:, 0], torch.ones(len(piece)))


def test_direction_and_length():
    assert direction(AHEAD) == 0
    assert direction(AHEAD @ torch.tensor([[0.0, -1], [1, 0]])) == pytest.approx(-math.pi / 2)
    assert length(AHEAD) == pytest.approx(4)


def test_directions_tell_by_how_much_an_angle_is_outside():
    behind = Directions(math.pi, 0.5)
    assert behind.outside(-math.pi + 0.4) == pytest.approx(0)
    assert behind.outside(math.pi - 0.7) == pytest.approx(-0.2)
    assert behind.outside(-math.pi + 0.7) == pytest.approx(0.2)
    assert Directions(0.0, math.pi).outside(3.0) == 0


def test_short_paths_go_on_and_long_ones_are_cut():
    path = torch.stack([torch.arange(20.0), torch.zeros(20)], dim=-1)
    assert torch.equal(fit_path(path, 5), path[:5])
    torch.testing.assert_close(fit_path(path, 23)[:, 0], torch.arange(23.0))
