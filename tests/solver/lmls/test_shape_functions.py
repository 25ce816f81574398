import numpy as np
import pytest
from clouds import clouds
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from solver.lmls.shape_functions import approximation, diffuse, full, monomials
from solver.points.cloud import given_points, random_points

CLOUD = random_points((0, 6), (-2, 2), 300, 4)


def polynomial(cloud, degree, seed):
    """A polynomial scaled to the domain, as a function of places that gives value and both derivatives."""
    factors = np.random.default_rng(seed).uniform(-1, 1, 6)
    factors[3 if degree == 1 else 6 :] = 0
    middle, size = np.array([cloud.x, cloud.y]).mean(axis=1), np.ptp(cloud.x) / 2

    def evaluate(places):
        x, y = ((places - middle) / size).T
        a, b, c, d, e, f = factors
        value = a + b * x + c * y + d * x * x + e * x * y + f * y * y
        return value, (b + 2 * d * x + e * y) / size, (c + e * x + 2 * f * y) / size

    return evaluate


def twin(points, place, values, degree, weight_shape):
    """Value, and diffuse and full derivatives at one place, from the moment matrix and the product rule."""
    offset = points - place
    radius = np.hypot(*offset.T).max()
    p = monomials_and_derivatives(offset / radius, degree)[0]
    at, at_x, at_y = (q[0] for q in monomials_and_derivatives(np.zeros((1, 2)), degree))
    w = np.exp(-weight_shape * (offset**2).sum(axis=1) / radius**2)
    moment, right = p.T @ (w[:, None] * p), p.T @ (w * values)
    alpha = np.linalg.solve(moment, right)
    derivatives = []
    for k, at_k in enumerate((at_x, at_y)):
        w_k = 2 * weight_shape * offset[:, k] / radius**2 * w
        moment_k, right_k = p.T @ (w_k[:, None] * p), p.T @ (w_k * values)
        alpha_k = np.linalg.solve(moment, right_k - moment_k @ alpha)
        derivatives.append((at_k @ alpha / radius, at_k @ alpha / radius + at @ alpha_k))
    return at @ alpha, *derivatives


def monomials_and_derivatives(offset, degree):
    x, y = offset.T
    one, zero = np.ones_like(x), np.zeros_like(x)
    p = np.array([one, x, y, x * x, x * y, y * y]).T
    p_x = np.array([zero, one, zero, 2 * x, y, zero]).T
    p_y = np.array([zero, zero, one, zero, x, 2 * y]).T
    return [q[:, : 3 if degree == 1 else 6] for q in (p, p_x, p_y)]


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    clouds(),
    st.sampled_from([(1, 7), (1, 13), (2, 13), (2, 25), (2, 49)]),
    st.floats(1, 9),
    st.sampled_from([diffuse, full]),
    st.integers(0, 99),
)
def test_polynomials_of_the_degree_are_reproduced(cloud, order, weight_shape, derivative, seed):
    degree, support = order
    assume(support <= len(cloud.points))
    wanted = polynomial(cloud, degree, seed)
    values, _, _ = wanted(cloud.points)
    for places in (cloud.points, cloud.control_volumes.midpoint, cloud.control_volumes.side_midpoint):
        near = cloud.nearest(support, places)
        found = approximation(cloud.points, places, near, degree, weight_shape, derivative)
        value, along, across = wanted(places)
        np.testing.assert_allclose(found.apply(found.value, values), value, atol=1e-10)
        np.testing.assert_allclose(found.apply(found.along, values), along, atol=1e-10)
        np.testing.assert_allclose(found.apply(found.across, values), across, atol=1e-10)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("weight_shape", [1.0, 9.0])
def test_weights_are_those_of_the_moment_matrix(degree, weight_shape):
    values = np.sin(3 * CLOUD.points[:, 0]) * np.exp(CLOUD.points[:, 1])
    places = CLOUD.control_volumes.midpoint[::20]
    near = CLOUD.nearest(15, places)
    wls, mls = (
        approximation(CLOUD.points, places, near, degree, weight_shape, way) for way in (diffuse, full)
    )
    for k, place in enumerate(places):
        value, along, across = twin(CLOUD.points[near[k]], place, values[near[k]], degree, weight_shape)
        for found, j in ((wls, 0), (mls, 1)):
            assert found.apply(found.value, values)[k] == pytest.approx(value, rel=1e-9)
            assert found.apply(found.along, values)[k] == pytest.approx(along[j], rel=1e-9, abs=1e-9)
            assert found.apply(found.across, values)[k] == pytest.approx(across[j], rel=1e-9, abs=1e-9)


def test_the_full_derivative_is_that_of_the_value():
    """Compare with difference quotients of the value at constant support and radius."""
    points = CLOUD.points[CLOUD.nearest(20)[150]]
    values = np.cos(2 * points[:, 0] + points[:, 1])
    place, step = points[:1] + 0.03, 1e-5
    near = np.arange(20)[None]
    exact = approximation(points, place, near, 2)
    radius = np.hypot(*(points - place).T).max()
    for k, weights in enumerate((exact.along, exact.across)):
        ends = []
        for sign in (-1, 1):
            moved = place.copy()
            moved[0, k] += sign * step
            now = np.hypot(*(points - moved).T).max()
            # the weight's width is c / r^2: undo what the step did to r
            found = approximation(points, moved, near, 2, 9.0 * (now / radius) ** 2)
            ends.append(found.apply(found.value, values)[0])
        assert exact.apply(weights, values)[0] == pytest.approx((ends[1] - ends[0]) / (2 * step), rel=1e-6)


def test_diffuse_and_full_derivatives_differ_beyond_their_degree():
    near = CLOUD.nearest(25)
    values = CLOUD.points[:, 0] ** 3
    one, two = (approximation(CLOUD.points, CLOUD.points, near, 2, 9.0, way) for way in (diffuse, full))
    assert np.abs(one.apply(one.along, values) - two.apply(two.along, values)).max() > 1e-4


@pytest.mark.parametrize("derivative", [diffuse, full])
def test_derivatives_converge_with_order_two(derivative):
    errors = []
    for count in (500, 2000, 8000):
        cloud = random_points((0, 6), (-2, 2), count, 1)
        f = np.sin(cloud.points[:, 0]) * np.cos(cloud.points[:, 1])
        a = approximation(cloud.points, cloud.points, cloud.nearest(13), 2, 4.0, derivative)
        wanted = np.cos(cloud.points[:, 0]) * np.cos(cloud.points[:, 1])
        errors.append(np.sqrt(np.mean((a.apply(a.along, f) - wanted) ** 2)))
    order = np.polyfit(np.log([500, 2000, 8000]) / 2, -np.log(errors), 1)[0]
    assert 1.8 < order < 2.4


def test_means_over_cells_are_fitted_as_means():
    cells = CLOUD.control_volumes
    wanted = polynomial(CLOUD, 2, 3)
    value, along, across = wanted(cells.centroid)
    size = np.ptp(CLOUD.x) / 2
    factors = np.random.default_rng(3).uniform(-1, 1, 6)[3:] / size**2
    means = value + cells.second_moment @ factors
    found = approximation(
        cells.centroid, cells.centroid, CLOUD.nearest(13), 2, second_moment=cells.second_moment
    )
    for weights, exact in ((found.value, value), (found.along, along), (found.across, across)):
        np.testing.assert_allclose(found.apply(weights, means), exact, atol=1e-11)


def test_condition_numbers_are_those_of_the_moment_matrices():
    near = CLOUD.nearest(13)
    found = approximation(CLOUD.points, CLOUD.points, near, 2)
    for i in range(0, len(CLOUD), 30):
        offset = CLOUD.points[near[i]] - CLOUD.points[i]
        radius = np.hypot(*offset.T).max()
        p = monomials(offset / radius, 2)
        w = np.exp(-9 * (offset**2).sum(axis=1) / radius**2)
        assert found.condition[i] == pytest.approx(np.linalg.cond(p.T @ (w[:, None] * p)), rel=1e-6)


def test_supports_that_cannot_carry_the_basis_are_named():
    line = np.c_[np.linspace(0, 1, 9), np.full(9, 0.5)]
    cloud = given_points(np.concatenate([line, [[0.5, 10.0]]]), (0, 1), (0, 10))
    with pytest.raises(ValueError, match=r"nearest 5 points cannot carry .* degree 1 at .* at \(0, 0.5\)"):
        approximation(cloud.points, cloud.points, cloud.nearest(5), 1)
    with pytest.raises(ValueError, match="5 points cannot carry a basis of 6 terms"):
        approximation(CLOUD.points, CLOUD.points, CLOUD.nearest(5), 2)
    with pytest.raises(ValueError, match="degree 1 or 2, not 3"):
        approximation(CLOUD.points, CLOUD.points, CLOUD.nearest(15), 3)


def test_points_on_a_conic_carry_no_quadratic():
    angle = np.linspace(0, 2 * np.pi, 13)[:-1]
    points = np.c_[np.cos(angle), np.sin(angle)]
    near = np.arange(12)[None]
    assert approximation(points, np.zeros((1, 2)), near, 1).condition[0] < 10
    with pytest.raises(ValueError, match="condition number"):
        approximation(points, np.zeros((1, 2)), near, 2)
