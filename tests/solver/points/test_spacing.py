import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from spacing import spacing_twin

from solver.points.poisson_disc import poisson_disc
from solver.points.spacing import Corridor, Refinement, Spacing, points_per_domain, spacing_at

X, Y = (0.0, 30.0), (-7.0, 7.0)
GRADED = Spacing(1.5, (Refinement((2, 6), (-2, 2), 0.4), Refinement((20, 20), (0, 0), 0.6)), 0.2)


@settings(derandomize=True, deadline=None, max_examples=50)
@given(*[st.floats(0, 30), st.floats(-7, 7)] * 2)
def test_spacing_changes_smoothly(x0, y0, x1, y1):
    law = GRADED.coarsest, GRADED.table, GRADED.growth
    one, two = spacing_at(x0, y0, *law), spacing_at(x1, y1, *law)
    assert abs(one - two) <= GRADED.growth * np.hypot(x1 - x0, y1 - y0) + 1e-12
    assert GRADED.finest <= one <= GRADED.coarsest
    assert one == spacing_twin(GRADED, np.float64(x0), np.float64(y0))


CHANNEL = Spacing(
    1.5, (Corridor(((2, -3), (12, 1), (12, 1), (25, 0)), 0.3, 0.5), Refinement((20, 22), (4, 5), 0.6)), 0.2
)


@settings(derandomize=True, deadline=None, max_examples=50)
@given(*[st.floats(0, 30), st.floats(-7, 7)] * 2)
def test_spacing_follows_a_line_and_changes_smoothly(x0, y0, x1, y1):
    law = CHANNEL.coarsest, CHANNEL.table, CHANNEL.growth
    one, two = spacing_at(x0, y0, *law), spacing_at(x1, y1, *law)
    assert abs(one - two) <= CHANNEL.growth * np.hypot(x1 - x0, y1 - y0) + 1e-12
    assert CHANNEL.finest == 0.3 <= one <= CHANNEL.coarsest
    assert one == pytest.approx(float(spacing_twin(CHANNEL, np.float64(x0), np.float64(y0))), abs=1e-12)


def test_points_stand_closer_along_a_line():
    points = poisson_disc(X, Y, CHANNEL, 3)
    to_line = shapely.distance(shapely.points(points), shapely.LineString(CHANNEL.refinements[0].line))
    length = shapely.LineString(CHANNEL.refinements[0].line).length
    inside = (to_line <= 0.5).sum()
    assert inside == pytest.approx((length + np.pi / 4) / 0.3**2, rel=0.1)
    assert len(points) < 0.3 * 30 * 14 / 0.3**2


def test_points_asked_for_are_the_integral_of_the_spacing():
    columns, rows = 300, 140
    x, y = np.meshgrid((np.arange(columns) + 0.5) / 10, (np.arange(rows) + 0.5) / 10 - 7)
    wanted = (0.01 / spacing_twin(GRADED, x, y) ** 2).sum()
    law = GRADED.coarsest, GRADED.table, GRADED.growth
    found = points_per_domain(np.array([*X, *Y]), *law, columns, rows)
    assert found == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: Spacing(0.0),
        lambda: Spacing(np.nan),
        lambda: Spacing(1.0, growth=0.0),
        lambda: Spacing(1.0, growth=0.6),
        lambda: Refinement((1, 0), (0, 1), 0.1),
        lambda: Refinement((0, np.inf), (0, 1), 0.1),
        lambda: Refinement((0, 1), (0, 1), -0.1),
        lambda: Corridor(((0, 0), (1, 1)), 0.0),
        lambda: Corridor(((0, 0), (1, 1)), 0.1, -1.0),
        lambda: Corridor(((0, 0), (1, 1)), np.nan),
    ],
)
def test_numbers_out_of_range_are_refused(wrong):
    with pytest.raises(ValueError, match="must"):
        wrong()


@pytest.mark.parametrize("line", [((0, 0),), ((0, 0), (np.nan, 1))])
def test_a_line_of_less_than_two_corners_is_refused(line):
    with pytest.raises(ValueError, match="two corners or more"):
        Corridor(line, 0.1)
