import numpy as np
import pytest
from numpy.polynomial import Polynomial

from solver.moving_least_squares import moments, shape_functions

CLOUD = np.sort(np.random.default_rng(2).uniform(-3, 2, 9))


@pytest.mark.parametrize("weight_shape", [1.0, 4.0, 9.0])
@pytest.mark.parametrize("degree", range(4))
@pytest.mark.parametrize("width", [0.0, 0.4], ids=["points", "means"])
def test_polynomials_up_to_the_degree_are_reproduced(degree, width, weight_shape):
    polynomial = Polynomial(np.random.default_rng(degree).normal(size=degree + 1))
    values = polynomial(CLOUD)
    if width:
        integral = polynomial.integ()
        values = (integral(CLOUD + width / 2) - integral(CLOUD - width / 2)) / width
    for at in (-1.2, 0.0, 0.7):
        weights = shape_functions(CLOUD, at, degree, width, weight_shape)
        assert weights @ values == pytest.approx(polynomial(at), abs=1e-10)
        assert weights.sum() == pytest.approx(1, abs=1e-12)


def test_a_polynomial_beyond_the_degree_is_not_reproduced():
    weights = shape_functions(CLOUD, 0.3, 2)
    assert abs(weights @ CLOUD**3 - 0.3**3) > 1e-3


def test_shape_functions_know_neither_origin_nor_unit():
    weights = shape_functions(CLOUD, 0.3, 2, 0.4)
    np.testing.assert_allclose(shape_functions(CLOUD + 50, 50.3, 2, 0.4), weights, rtol=1e-9)
    np.testing.assert_allclose(shape_functions(7 * CLOUD, 2.1, 2, 2.8), weights, rtol=1e-9)
    np.testing.assert_allclose(shape_functions(-CLOUD, -0.3, 2, 0.4), weights, rtol=1e-9)


def test_a_sharper_weight_trusts_the_nearest_points_more():
    points = np.linspace(-1, 1, 9)
    flat, sharp = (shape_functions(points, 0.0, 2, weight_shape=c) for c in (1.0, 9.0))
    assert sharp[4] > flat[4]
    assert abs(sharp[0]) < abs(flat[0])


def test_moments_are_means_of_the_monomials():
    x = np.linspace(-0.5, 0.5, 100_001)
    expected = [[np.trapezoid((p + 0.2 * x) ** k, x) for k in range(4)] for p in (-0.7, 0.1)]
    np.testing.assert_allclose(moments(np.array([-0.7, 0.1]), np.full(2, 0.2), 3), expected, atol=1e-9)
    assert moments(np.array([2.0]), np.zeros(1), 3).tolist() == [[1, 2, 4, 8]]


@pytest.mark.parametrize("points", [[0.0, 1.0], [0.0, 0.0, 1.0], [1.0, -1.0, -1.0, 1.0]])
def test_a_support_too_small_for_its_basis_is_an_error(points):
    with pytest.raises(ValueError, match="cannot carry"):
        shape_functions(np.array(points), 0.2, 2)
