"""Elevation models: corners, curvature and gaps."""

import numpy as np
import pytest

from solver.physics.elevation import ElevationModel

X, Y = np.arange(0.0, 100.0, 5.0), np.arange(0.0, 60.0, 5.0)


def model(function, length=0.0):
    return ElevationModel(X, Y, function(X[None, :], Y[:, None]) + 0.0 * (X[None, :] + Y[:, None]), length)


def test_corners_are_the_means_of_four_cells():
    found = model(lambda x, y: x**2 + x * y).corners(X[3:6] - 2.5, Y[2:4] - 2.5)
    z = X[None, :] ** 2 + X[None, :] * Y[:, None]
    means = (z[:-1, :-1] + z[:-1, 1:] + z[1:, :-1] + z[1:, 1:]) / 4
    np.testing.assert_allclose(found, means[1:3, 2:5], rtol=1e-15)


@pytest.mark.parametrize("spacing", [2.0, 5.0, 10.0, 12.5])
def test_a_plane_stays_a_plane_on_any_spacing(spacing):
    x, y = np.arange(20.0, 70.0, spacing), np.arange(15.0, 45.0, spacing)
    found = model(lambda x, y: 0.3 * x - 0.2 * y).corners(x, y)
    np.testing.assert_allclose(found, 0.3 * x[None, :] - 0.2 * y[:, None], atol=1e-10)


@pytest.mark.parametrize("length", [0.0, 10.0])
def test_curvature_of_a_paraboloid(length):
    found = model(lambda x, y: 0.01 * x**2 - 0.02 * x * y + 0.03 * y**2, length).hessian(X[8:12], Y[5:7])
    for values, expected in zip(found, (0.02, -0.02, 0.06), strict=True):
        np.testing.assert_allclose(values, expected, atol=1e-4)


def test_no_curvature_where_it_is_left_out():
    assert not np.any(model(lambda x, y: x**2, None).hessian(X, Y))


def test_gaps_are_cells_without_data_and_all_beyond_the_raster():
    given = model(lambda x, y: x)
    given.elevation[3, 4] = np.nan
    found = given.gaps(np.array([-5.0, 0.0, 19.0, 95.0, 98.0]), np.array([15.0, 55.0, 60.0]))
    np.testing.assert_array_equal(found[0], [True, False, True, False, True])
    np.testing.assert_array_equal(found[1], [True, False, False, False, True])
    assert found[2].all()
    assert np.isfinite(given.corners(X[:-1] + 2.5, Y[:-1] + 2.5)).all()


@pytest.mark.parametrize(
    ("x", "z", "words"),
    [
        (X[::-1], np.zeros((12, 20)), "even and increasing"),
        (2 * X, np.zeros((12, 20)), "square"),
        (X, np.zeros((20, 12)), "one value a cell"),
        (X, np.full((12, 20), np.nan), "no data"),
    ],
)
def test_what_is_no_elevation_model_is_refused(x, z, words):
    with pytest.raises(ValueError, match=words):
        ElevationModel(x, Y, z)
