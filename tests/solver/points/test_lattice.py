import numpy as np
import pytest

from solver.points.lattice import Lattice


def test_points_run_from_bound_to_bound():
    lattice = Lattice((0, 30), (-7, 7), 0.2)
    assert lattice.shape == (71, 151)
    assert (lattice.x_points[0], lattice.x_points[-1]) == (0, 30)
    assert (lattice.y_points[0], lattice.y_points[-1]) == (-7, 7)
    np.testing.assert_allclose(np.diff(lattice.x_points), 0.2, rtol=1e-12)
    assert lattice.cell_area == pytest.approx(0.04, rel=1e-14)


@pytest.mark.parametrize(("spacing", "intervals"), [(0.3, 3), (0.4, 2), (0.9, 1), (50.0, 1)])
def test_a_spacing_that_does_not_divide_an_extent_becomes_the_nearest_that_does(spacing, intervals):
    lattice = Lattice((1, 2), (0, 3.6), spacing)
    assert len(lattice.x_points) == intervals + 1
    assert lattice.dx == pytest.approx(1 / intervals)
    assert lattice.dy == pytest.approx(3.6 / max(1, round(3.6 / spacing)))


@pytest.mark.parametrize("spacing", [0.1, 0.2, 0.3, 1 / 3, 0.7])
@pytest.mark.parametrize("half", [1.0, 7.0, 3.3])
def test_symmetric_bounds_have_symmetric_points_to_the_last_bit(half, spacing):
    y = Lattice((0, 1), (-half, half), spacing).y_points
    assert (y == -y[::-1]).all()
    assert (np.diff(y) > 0).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((1, 1), (0, 1), 0.1), "increase"),
        (((0, 1), (2, 1), 0.1), "increase"),
        (((0, 1), (0, 1), 0.0), "above 0"),
        (((0, 1), (0, 1), -0.1), "above 0"),
        (((0, np.inf), (0, 1), 0.1), "finite"),
        (((0, 1), (np.nan, 1), 0.1), "finite"),
        (((0, 1), (0, 1), np.nan), "finite"),
    ],
)
def test_an_impossible_lattice_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Lattice(*arguments)
