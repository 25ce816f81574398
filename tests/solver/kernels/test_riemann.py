import dense
import numpy as np
import pytest

from solver.kernels.riemann import hll
from solver.kernels.state import BELOW_YIELD, DRY, FaceValues, Fluxes

LIMIT = 1e-4


def kernel(a, p, s, b, q, t, c_a, c_b, static_a, static_b):
    """The kernel over faces between the states (a, p, s) and (b, q, t) of cells with wave speeds c."""
    n = len(a)
    unused = np.full(n, np.nan)
    out = Fluxes(*np.zeros((4, n)))
    low = FaceValues(unused, a, unused, p, unused, s, c_a)
    high = FaceValues(b, unused, q, unused, t, unused, c_b)
    hll(low, 0, high, 0, np.concatenate([static_a, static_b]), 0, n, n, LIMIT, out, 0)
    return out


def random_states(seed=0, n=4000):
    """Depths from dry to deep, speeds from rest to supercritical; some pairs equal, mirrored or static."""
    rng = np.random.default_rng(seed)

    def some(part):
        return rng.random(n) < part

    a, b = 10.0 ** rng.uniform(-6, 1, (2, n)) * (rng.random((2, n)) < 0.85)
    p, q = rng.normal(0, 1, (2, n)) * 10.0 ** rng.uniform(-2, 1.5, n) * (rng.random((2, n)) < 0.8)
    s, t = rng.normal(0, 3, (2, n))
    equal, mirrored = some(0.2), some(0.2)
    b, q = np.where(equal | mirrored, a, b), np.where(mirrored, -p, np.where(equal, p, q))
    # the speed of a cell is that of its mean depth, which is not that at the face
    beta = rng.uniform(1, 10, n)
    c_a, c_b = np.sqrt(beta * a * rng.uniform(0.5, 2, n)), np.sqrt(beta * b * rng.uniform(0.5, 4, n))
    c_b = np.where(equal | mirrored, c_a, c_b)
    return a, p, s, b, q, t, c_a, c_b, *(some(0.3) * rng.integers(1, 3, (2, n)) * 1.0)


def test_the_flux_is_its_twin():
    states = random_states()
    a, p, s, b, q, t, c_a, c_b, *_ = states
    speed = np.abs([p, q, s, t]).sum(axis=0) + c_a + c_b
    sizes = (a + b) * speed, (a + b) * speed**2, (a + b) * speed**2, (a + b) ** 2
    for actual, expected, size in zip(kernel(*states), dense.hll(*states, LIMIT), sizes, strict=True):
        assert (np.abs(actual - expected) <= 1e-14 * size).all()


def test_equal_states_exchange_the_flux_of_the_equations():
    a, p, s, *_, c, _, _, _ = random_states()
    none = 0 * a
    flux = kernel(a, p, s, a, p, s, c, c, none, none)
    wet = a > LIMIT
    for actual, exact in zip(flux, (a * p, a * p * p, a * p * s, a * a / 2), strict=True):
        np.testing.assert_allclose(actual[wet], exact[wet], rtol=1e-13, atol=1e-15)


def test_supercritical_flow_is_upwind():
    a, b = np.array([0.5, 1e-5]), np.array([0.1, 0.3])
    p, q = np.array([9.0, 9.0]), np.array([8.0, 8.0])
    s, t, c, none = np.full(2, 1.0), np.full(2, -1.0), np.full(2, 1.5), np.zeros(2)
    flux = kernel(a, p, s, b, q, t, c, c, none, none)
    np.testing.assert_allclose(flux.mass, a * p, rtol=1e-14)
    np.testing.assert_allclose(flux.tangential, a * p * s, rtol=1e-14)
    back = kernel(b, -q, t, a, -p, s, c, c, none, none)
    np.testing.assert_allclose(back.mass, -a * p, rtol=1e-14)


def test_the_mirror_image_has_the_mirrored_flux_to_the_last_bit():
    a, p, s, b, q, t, c_a, c_b, static_a, static_b = random_states(1)
    here = kernel(a, p, s, b, q, t, c_a, c_b, static_a, static_b)
    there = kernel(b, -q, t, a, -p, s, c_b, c_a, static_b, static_a)
    for k, sign in ((0, -1), (1, 1), (2, -1), (3, 1)):
        np.testing.assert_array_equal(here[k], sign * there[k])


def test_a_flow_and_its_mirror_image_exchange_no_mass():
    a, p, s, *_, c, _, static, _ = random_states(2)
    flux = kernel(a, p, s, a, -p, s, c, c, static, static)
    assert not flux.mass.any()
    assert not flux.tangential.any()


def test_nothing_leaves_a_still_cell():
    *states, static_a, static_b = random_states(3)
    a, _, _, b, *_ = states
    flux = kernel(*states, static_a, static_b)
    assert (flux.mass[static_a > 0] <= 0).all()
    assert (flux.mass[static_b > 0] >= 0).all()
    both = (static_a > 0) & (static_b > 0)
    assert not flux.mass[both].any()
    assert not flux.tangential[both].any()
    free = kernel(*states, 0 * static_a, 0 * static_b)
    neither = (static_a == 0) & (static_b == 0)
    for held, moving in zip(flux, free, strict=True):
        np.testing.assert_array_equal(held[neither], moving[neither])
    assert (free.mass[both] != 0).any()
    assert not flux.mass[(a == 0) & (b == 0)].any()


def test_a_level_layer_at_rest_feels_its_pressure_and_nothing_else():
    h, zero, one = np.array([0.0, 1e-5, 0.3, 7.0]), np.zeros(4), np.ones(4)
    c = np.sqrt(9.81 * h)
    for static in (zero, one, 2 * one):
        flux = kernel(h, zero, zero, h, zero, zero, c, c, static, static)
        assert not flux.mass.any()
        assert not flux.normal.any()
        np.testing.assert_allclose(flux.pressure, h**2 / 2, rtol=1e-15)


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("static", [BELOW_YIELD, DRY])
def test_what_leans_on_a_still_cell_is_pushed_by_no_more_than_its_own_pressure(swap, static):
    deep, thin, zero, stays = np.array([1.0]), np.array([0.2]), np.zeros(1), np.full(1, static)
    c, d = np.sqrt(9.81 * deep), np.sqrt(9.81 * thin)
    if swap:
        flux = kernel(thin, zero, zero, deep, zero, zero, d, c, zero, stays)
    else:
        flux = kernel(deep, zero, zero, thin, zero, zero, c, d, stays, zero)
    assert not flux.mass.any()
    assert flux.pressure[0] == pytest.approx(0.02, rel=1e-15)


def test_a_deep_cell_leans_on_a_thin_held_one_and_not_on_one_that_was_dry():
    """The thin one, free to move, would be thrown off by it."""
    deep, thin, zero, away = np.array([1.0]), np.array([1e-3]), np.zeros(1), np.array([6.0])
    c, d = np.sqrt(9.81 * deep), np.sqrt(9.81 * thin)
    for static, pressure in ((BELOW_YIELD, 0.5), (DRY, 0.5e-6)):
        flux = kernel(thin, away / 6, zero, deep, away, zero, d, c, np.full(1, static), zero)
        assert not flux.mass.any()
        assert flux.pressure[0] == pytest.approx(pressure, rel=1e-15)
