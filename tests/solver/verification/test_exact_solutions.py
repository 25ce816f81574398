"""The exact solutions solve their equations: checked by central differences and jump conditions."""

import numpy as np
import pytest

from solver.physics.constants import GRAVITY
from solver.verification.exact_solutions import (
    DamBreak,
    FrictionlessCap,
    ParabolicCap,
    TravellingShock,
    WetDamBreak,
    cell_means,
)

STEP = 1e-4


def slope(function, *place, axis):
    """Central difference along one of the arguments."""
    low, high = (list(place) for _ in range(2))
    low[axis], high[axis] = low[axis] - STEP, high[axis] + STEP
    return (function(*high) - function(*low)) / (2 * STEP)


def residuals(solution, x, time, beta, pull):
    """Of mass and momentum, ``u_t + u u_x + beta h_x = pull``, along one direction."""

    def depth(x, t):
        return solution(x, t)[0]

    def velocity(x, t):
        return solution(x, t)[1]

    def discharge(x, t):
        return depth(x, t) * velocity(x, t)

    u = velocity(x, time)
    mass = slope(depth, x, time, axis=1) + slope(discharge, x, time, axis=0)
    momentum = slope(velocity, x, time, axis=1) + u * slope(velocity, x, time, axis=0)
    return mass, momentum + beta * slope(depth, x, time, axis=0) - pull


def on_plane(angle, bed_friction):
    xi, delta = np.radians([angle, bed_friction])
    return GRAVITY * np.cos(xi), GRAVITY * (np.sin(xi) - np.cos(xi) * np.tan(delta))


SMOOTH = {
    "dam break 22/21": (DamBreak(), 5.0, (-13.0, 28.0), on_plane(22, 21)),
    "dam break 30/20": (DamBreak(30, 20), 3.0, (-1.0, 18.0), on_plane(30, 20)),
    "Ritter": (DamBreak(0, 0), 2.0, (-6.0, 12.0), (GRAVITY, 0.0)),
    "Stoker": (WetDamBreak(), 2.0, (-6.0, 1.5), (GRAVITY, 0.0)),
    "parabolic cap": (ParabolicCap(), 2.0, (-10.0, 20.0), on_plane(35, 20)),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_mass_and_momentum_are_conserved_where_smooth(name):
    solution, time, (low, high), (beta, pull) = SMOOTH[name]
    x = np.linspace(low, high, 17)
    assert (solution(x, time)[0] > 0).all()
    mass, momentum = residuals(solution, x, time, beta, pull)
    np.testing.assert_allclose(mass, 0, atol=1e-6)
    np.testing.assert_allclose(momentum, 0, atol=1e-6)


@pytest.mark.parametrize("time", [0.5, 5.0])
def test_the_round_cap_conserves_mass_and_momentum_in_the_plane(time):
    cap = FrictionlessCap()
    beta, pull = on_plane(35, 0)
    x, y = np.meshgrid(pull * time**2 / 2 + np.linspace(-40, 40, 7), np.linspace(-35, 35, 5))
    assert (cap(x, y, time)[0] > 0).all()

    def field(k):
        return lambda *place: cap(*place)[k]

    def discharge(k):
        return lambda *place: cap(*place)[0] * cap(*place)[k]

    _, u, v = cap(x, y, time)
    h_x, h_y = (slope(field(0), x, y, time, axis=axis) for axis in (0, 1))
    mass = slope(field(0), x, y, time, axis=2)
    mass += slope(discharge(1), x, y, time, axis=0) + slope(discharge(2), x, y, time, axis=1)
    np.testing.assert_allclose(mass, 0, atol=1e-6)
    for k, force in ((1, pull - beta * h_x), (2, -beta * h_y)):
        change = slope(field(k), x, y, time, axis=2) + u * slope(field(k), x, y, time, axis=0)
        change += v * slope(field(k), x, y, time, axis=1)
        np.testing.assert_allclose(change, force, atol=1e-6)


@pytest.mark.parametrize("time", [0.0, 2.0, 5.0])
def test_caps_keep_their_volume(time):
    points = np.linspace(-200, 400, 2401)
    depth = FrictionlessCap()(points[None], points[:, None], time)[0]
    assert depth.sum() * 0.25**2 == pytest.approx(np.pi / 2 * 4 * 80**2, rel=1e-4)
    depth = ParabolicCap()(points, time)[0]
    assert depth.sum() * 0.25 == pytest.approx(4 / 3 * 20, rel=1e-3)


def test_caps_start_at_rest_with_their_height_and_radius():
    x = np.array([-80.1, -79.9, 0.0])
    depth, u, v = FrictionlessCap()(x, 0 * x, 0.0)
    assert depth[0] == 0 < depth[1]
    assert depth[2] == 4
    assert not u.any()
    assert not v.any()
    depth, u = ParabolicCap()(np.array([-20.01, -19.99, 0.0]), 0.0)
    assert depth[0] == 0 < depth[1]
    assert depth[2] == 1
    assert not u.any()


def test_the_rear_of_the_parabolic_cap_moves_down():
    cap = ParabolicCap()
    beta, pull = on_plane(cap.angle, cap.bed_friction)
    assert pull > 2 * beta * cap.height / cap.half_length
    for time in (0.1, 1.0, 4.0):
        assert cap(np.linspace(-25, 120, 2901), time)[1].min() >= 0


@pytest.mark.parametrize("dam", [DamBreak(), DamBreak(30, 20), DamBreak(0, 0, 2.5)])
def test_the_dam_break_joins_the_layer_behind_it_and_ends_at_its_front(dam):
    beta, pull = on_plane(dam.angle, dam.bed_friction)
    time, c = 3.0, np.sqrt(beta * dam.depth)
    tail, front = pull * time**2 / 2 - c * time, pull * time**2 / 2 + 2 * c * time
    depth, u = dam(np.array([tail - 5, tail, front - 1e-9, front, front + 5]), time)
    np.testing.assert_allclose(depth, [dam.depth, dam.depth, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(u[:2], pull * time, rtol=1e-12)
    assert u[2] == pytest.approx(2 * c + pull * time)
    assert u[4] == 0


@pytest.mark.parametrize("ahead", [0.01, 0.2, 0.9])
def test_stokers_dam_break_is_continuous_but_for_a_shock_that_conserves(ahead):
    dam, time = WetDamBreak(1.0, ahead), 2.0
    c = np.sqrt(GRAVITY)
    x = np.linspace(-8, 16, 48_001)
    depth, velocity = dam(x, time)
    k = int(np.argmin(np.diff(depth)))
    middle, u = depth[k], velocity[k]
    assert depth[k + 1] == ahead
    assert velocity[k + 1] == 0
    speed = (x[k] + x[k + 1]) / 2 / time
    assert speed * (middle - ahead) == pytest.approx(middle * u, rel=1e-3)
    force = GRAVITY * (middle**2 - ahead**2) / 2
    assert speed * middle * u == pytest.approx(middle * u**2 + force, rel=1e-3)
    np.testing.assert_allclose(np.delete(np.diff(depth), k), 0, atol=2e-3)
    assert u == pytest.approx(2 * (c - np.sqrt(GRAVITY * middle)), rel=1e-12)
    assert (depth.sum() * 5e-4) == pytest.approx(8 + 16 * ahead, rel=1e-3)


@pytest.mark.parametrize("shock", [TravellingShock(), TravellingShock(0.1, 2.0, 25.0)])
def test_the_travelling_shock_conserves_mass_and_momentum(shock):
    beta = GRAVITY * np.cos(np.radians(shock.angle))
    (h1, h2), (u1, u2) = shock(np.array([-1e-9, 1e-9]) + shock.speed * 3, 3.0)
    assert (h1, h2, u1, u2) == (shock.upstream, shock.downstream, shock.arriving, 0)
    assert shock.speed < 0 < shock.arriving
    assert shock.speed * (h2 - h1) == pytest.approx(h2 * u2 - h1 * u1, rel=1e-12)
    jump = (h2 * u2**2 + beta * h2**2 / 2) - (h1 * u1**2 + beta * h1**2 / 2)
    assert shock.speed * (h2 * u2 - h1 * u1) == pytest.approx(jump, rel=1e-12)


def test_cell_means_are_means_over_cells():
    points = np.array([-1.0, 0.0, 2.0])
    means = cell_means(lambda x, t: (t * x**2, x), points, 0.5, 3.0)
    np.testing.assert_allclose(means, 3 * (points**2 + 0.5**2 / 12), rtol=1e-3)
