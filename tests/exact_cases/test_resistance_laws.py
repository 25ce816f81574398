"""Resistance laws against closed forms and ordinary differential equations: a sheet on a uniform slope.

A sheet of uniform depth h on a slope obeys ``du/dt = g sin xi - R(u, h)``. Terminal speeds, thicknesses at
which it rests and limits of stability are met to six digits. Transients are of first order in the time step;
their limit, extrapolated from several steps, is met to five digits.
"""

from functools import cache
from itertools import pairwise

import numba
import numpy as np
import pytest
from scipy.optimize import brentq

from solver.kernels.friction import resistance, rest_stress
from solver.kernels.source_terms import update_cell
from solver.physics.friction import (
    Bingham,
    Chezy,
    Coulomb,
    Edwards,
    HerschelBulkley,
    Manning,
    OBrien,
    Pouliquen,
    Voellmy,
    friction_angle,
)

G = 9.81
DENSITY = 2000.0


def angles(*coefficients):
    return tuple(map(friction_angle, coefficients))


def cohesive(xi=200.0):
    return Voellmy(friction_angle(0.2), xi, 1000.0, DENSITY)


VOELLMY, VOELLMY_ROUGH = Voellmy(friction_angle(0.1), 200.0), Voellmy(friction_angle(0.2), 200.0)
MANNING, CHEZY = Manning(0.05), Chezy(np.sqrt(500.0))
BINGHAM = Bingham(1000.0, 100.0, density=DENSITY)
HERSCHEL = {n: HerschelBulkley(1000.0, 500.0, n, DENSITY) for n in (1 / 3, 1 / 2)}
OBRIEN = OBrien(1000.0, 100.0, 0.05, 24.0, DENSITY)
BEADS = Pouliquen((21.0, 30.7), 0.136, 0.65e-3)
COARSE = Pouliquen(angles(0.2, 0.5), 0.136, 0.5)
EDWARDS = Edwards(angles(0.2, 0.5, 0.25), 0.136, 0.5, 0.136)

# law, inclination (degrees), depth (m), terminal speed (m s-1)
TERMINAL = [
    (VOELLMY, 20, 1, 7.04345),
    (cohesive(), 20, 1, 4.76040),
    (MANNING, 5, 2, 9.37270),
    (CHEZY, 5, 2, 9.33572),
    (BINGHAM, 10, 1, 6.50018),
    (BINGHAM, 10, 2, 35.4982),
    (Bingham(1000.0, 100.0, "linear", 1.5, DENSITY), 10, 1, 6.35659),
    (Bingham(1000.0, 100.0, "linear", 1.0, DENSITY), 10, 1, 8.02326),
    (HerschelBulkley(1000.0, 100.0, 1.0, DENSITY), 10, 1, 6.50018),
    (HERSCHEL[1 / 3], 10, 1, 16.9197),
    (HERSCHEL[1 / 2], 10, 1, 4.49350),
    (OBRIEN, 10, 1, 4.58545),
    (OBRIEN, 10, 2, 10.4449),
    (OBrien(1000.0, 100.0, 0.05, 2285.0, DENSITY), 10, 1, 0.0842583),
    (BEADS, 24, 0.01, 0.258783),
    (EDWARDS, 16, 2, 0.960986),
]
# law, inclination (degrees), thickness below which a sheet rests (m)
STOPPING = [
    (cohesive(), 15, 0.621240),
    (cohesive(), 20, 0.262539),
    (cohesive(), 30, 0.103146),
    (BINGHAM, 10, 0.293515),
    # a sheet at rest; one that moves stops below 1.22920 m
    (EDWARDS, 16, 3.58215),
]
# law, inclination (degrees), depth (m), first speed (m s-1), time (s), speed (m s-1), way (m)
MOVING = [
    (VOELLMY, 20, 1, 0, 5, 6.61203, 21.7199),
    (VOELLMY_ROUGH, 5, 1, 10, 1, 5.92210, None),
    (MANNING, 5, 2, 0, 5, 4.00129, None),
    (BINGHAM, 10, 1, 0, 1, 1.00934, None),
    (BINGHAM, 10, 1, 0, 3, 2.51552, None),
    (BINGHAM, 10, 1, 0, 10, 5.16225, None),
    (HERSCHEL[1 / 3], 10, 1, 0, 3, 2.07712, None),
    (OBRIEN, 10, 1, 0, 1, 1.10749, None),
    (OBRIEN, 10, 1, 0, 3, 2.71818, None),
    (BEADS, 24, 0.01, 0, 0.1, 0.0478474, None),
    (BEADS, 24, 0.01, 0, 0.5, 0.156554, None),
    (BEADS, 24, 0.01, 0, 1, 0.213593, None),
    (EDWARDS, 16, 2, 0.3, 5, 0.848259, None),
]
# law, inclination (degrees), depth (m), first speed (m s-1), time until it stops (s), way (m)
STOPS = [
    (VOELLMY_ROUGH, 5, 1, 10, 4.85979, 17.3051),
    (cohesive(), 5, 1, 10, 3.92956, 14.7997),
    (BINGHAM, 0, 1, 5, 5.05950, 10.7375),
    (HERSCHEL[1 / 3], 0, 1, 5, 4.47359, 10.2943),
    (OBRIEN, 0, 1, 5, 5.34802, 10.4628),
    (COARSE, 0, 2, 5, 1.55657, 3.50441),
    (EDWARDS, 16, 2, 0.25, 3.01777, None),
]
# law, inclination (degrees), depth (m), Froude number above which roll waves grow
ROLL_WAVES = [
    (VOELLMY, 20, 1, 2.0),
    (MANNING, 5, 2, 1.5),
    (BEADS, 24, 0.01, 2 / 3),
    (BINGHAM, 10, 2 * 0.293515, 0.263158),
    (BINGHAM, 10, 4 * 0.293515, 0.391304),
]


def six_digits(expected):
    """Agree with a number that is stated to six digits."""
    return pytest.approx(expected, abs=0.501 * 10.0 ** (np.floor(np.log10(abs(expected))) - 5))


def named(values):
    return [
        f"{type(law).__name__}, {', '.join(f'{v:.6g}' for v in rest if v is not None)}"
        for law, *rest in values
    ]


def table(names, values):
    return pytest.mark.parametrize(names, values, ids=named(values))


def drive(law, inclination, speed, h):
    """Acceleration of a sheet, m s-2."""
    xi = np.radians(inclination)
    return G * np.sin(xi) - resistance(law.resistance(G), speed, h, G * np.cos(xi))


def terminal(law, inclination, h, least=0.0):
    return brentq(lambda s: drive(law, inclination, s, h), least + 1e-9, 1e3, xtol=1e-13, rtol=1e-14)


@numba.njit
def slide(law, u, h, along, normal, dt, most):
    """Move a sheet until it stops or has taken ``most`` steps: time, speed, way, and the speed before."""
    way, before, now = 0.0, u, u
    for n in range(most):
        if now == 0.0 and n > 0:
            return n * dt, now, way, before
        before = now
        still = (0.0, 0.0, 0.0)
        state, pull, bed = (h, now, 0.0), (along * h, 0.0), (normal, 0.0)
        _, now, _ = update_cell(state, state, still, pull, bed, h, 1.0, dt, law, 0.0, 0.0)
        way += 0.5 * (before + now) * dt
    return most * dt, now, way, before


def moved(law, inclination, h, u, dt, most):
    xi = np.radians(inclination)
    return slide(law.resistance(G), float(u), float(h), G * np.sin(xi), G * np.cos(xi), dt, most)


def limit(values):
    """Extrapolate values of an error in whole powers of a step that is halved from one to the next."""
    values = list(values)
    for order in range(1, len(values)):
        values = [b + (b - a) / (2**order - 1) for a, b in pairwise(values)]
    return values[0]


@table(("law", "inclination", "h", "expected"), TERMINAL)
def test_the_terminal_speed_is_where_resistance_balances_gravity(law, inclination, h, expected):
    assert terminal(law, inclination, h, 0.5 if law is EDWARDS else 0.0) == six_digits(expected)


@table(("law", "inclination", "h", "expected"), TERMINAL)
@pytest.mark.parametrize("dt", [0.01, 1.0, 100.0])
def test_a_step_of_any_length_leaves_the_terminal_speed_as_it_is(law, inclination, h, expected, dt):
    if law is EDWARDS and dt > 0.1:
        pytest.skip("friction that weakens with speed limits the step")
    speed = terminal(law, inclination, h, 0.5 if law is EDWARDS else 0.0)
    _, after, _, _ = moved(law, inclination, h, speed, dt, 1)
    assert after == pytest.approx(speed, rel=1e-12)


def test_friction_with_hysteresis_has_an_unstable_speed_too():
    assert brentq(lambda s: drive(EDWARDS, 16, s, 2.0), 0.1, 0.5, xtol=1e-13) == six_digits(0.274693)


@table(("law", "inclination", "expected"), STOPPING)
def test_a_sheet_at_rest_starts_above_the_stated_thickness(law, inclination, expected):
    xi, given = np.radians(inclination), law.resistance(G)
    found = brentq(
        lambda h: G * np.sin(xi) * h - rest_stress(given, h, h, G * np.cos(xi)), 1e-6, 10, xtol=1e-14
    )
    assert found == six_digits(expected)
    assert moved(law, inclination, found * (1 - 1e-6), 0.0, 0.01, 2)[1] == 0.0
    assert moved(law, inclination, found * (1 + 1e-6), 0.0, 0.01, 2)[1] > 0.0


def test_grains_flow_by_the_flow_rule_of_their_stopping_thickness():
    slope = np.tan(np.radians(24))
    slow, fast = np.tan(np.radians(BEADS.angles))
    stop = BEADS.length * (fast - slope) / (slope - slow)
    assert stop == six_digits(0.00157327)
    for h in (0.002, 0.01, 0.1):
        expected = BEADS.beta * h**1.5 * np.sqrt(G * np.cos(np.radians(24))) / stop
        assert terminal(BEADS, 24, h) == pytest.approx(expected, rel=1e-10)
    # of sand none flows below Fr = 0
    sand = Pouliquen(BEADS.angles, BEADS.beta, BEADS.length, 0.77)
    for factor, moves in ((1 - 1e-6, False), (1 + 1e-6, True)):
        h = factor * sand.gamma * stop / sand.beta
        assert (moved(sand, 24, h, 0.0, 0.01, 2)[1] > 0) == moves


def test_with_hysteresis_a_sheet_that_moves_stops_below_a_lesser_thickness():
    # at the speed of beta_star, the least at which friction is dynamic
    def excess(h):
        return drive(EDWARDS, 16, 0.136 * np.sqrt(G * np.cos(np.radians(16)) * h), h)

    assert brentq(excess, 0.1, 3.0, xtol=1e-14) == six_digits(1.22920)


@table(("law", "inclination", "h", "first", "time", "speed", "way"), MOVING)
def test_a_transient_is_of_first_order_in_the_step_and_has_the_stated_limit(
    law, inclination, h, first, time, speed, way
):
    counts = [160 * 2**k for k in range(5)]
    found = [moved(law, inclination, h, first, time / n, n) for n in counts]
    errors = [values[1] - speed for values in found]
    orders = [np.log2(a / b) for a, b in pairwise(errors)][:2]
    assert orders == pytest.approx([1.0, 1.0], abs=0.1)
    assert limit(values[1] for values in found) == pytest.approx(speed, rel=1e-5)
    if way is not None:
        assert limit(values[2] for values in found) == pytest.approx(way, rel=1e-5)


@table(("law", "inclination", "h", "first", "time", "way"), STOPS)
def test_a_sheet_stops_exactly_at_the_stated_time_and_place(law, inclination, h, first, time, way):
    late, far = [], []
    for dt in (0.004, 0.002, 0.001, 0.0005):
        until, speed, length, before = moved(law, inclination, h, first, dt, 100_000)
        assert speed == 0.0
        # what is left of the last step by the deceleration with which it stops
        rest = before / -drive(law, inclination, before, h)
        late.append(until - dt + rest)
        far.append(length + 0.5 * before * (rest - dt))
    for found, expected in ((late, time), (far, way)):
        if expected is not None:
            errors = [abs(value - expected) for value in found]
            assert errors[0] > 1.7 * errors[1] > 1.7**2 * errors[2]
            assert 2 * found[-1] - found[-2] == pytest.approx(expected, rel=3e-5)


@pytest.mark.parametrize("dt", [2.5, 0.7, 0.001])
def test_dry_friction_alone_slows_a_sheet_down_by_the_same_at_any_step(dt):
    xi, first = np.radians(5), 10.0
    braking = G * (0.2 * np.cos(xi) - np.sin(xi))
    assert first / braking == six_digits(9.09474)
    assert first**2 / (2 * braking) == six_digits(45.4737)
    until, speed, way, before = moved(Coulomb(friction_angle(0.2)), 5, 1, first, dt, 100_000)
    assert speed == 0.0
    # what is left of the last step
    rest = before / braking
    assert until - dt + rest == pytest.approx(first / braking, rel=1e-9)
    assert way + 0.5 * before * (rest - dt) == pytest.approx(first**2 / (2 * braking), rel=1e-9)


@table(("law", "inclination", "h", "expected"), ROLL_WAVES)
def test_roll_waves_grow_above_the_stated_froude_number(law, inclination, h, expected):
    """From ``1/(d ln u/d ln h)`` of steady flows on kinematic waves outrun those of depth."""
    step = 1e-4
    up, down = (terminal(law, inclination, h * (1 + s)) for s in (step, -step))
    slope = np.log(up / down) / np.log((1 + step) / (1 - step))
    assert 1 / slope == pytest.approx(expected, rel=1e-5)


@cache
def _draws(seed=1, count=200):
    rng = np.random.default_rng(seed)
    return [
        tuple(10 ** rng.uniform(low, high) for low, high in ((-6, 2), (-4, 1), (-6, 1))) for _ in range(count)
    ]


LAWS = [VOELLMY, cohesive(), MANNING, CHEZY, BINGHAM, HERSCHEL[1 / 3], OBRIEN, BEADS, COARSE, EDWARDS]


@pytest.mark.parametrize("law", LAWS, ids=[type(law).__name__ for law in LAWS])
def test_a_step_solves_its_equation_and_never_adds_speed(law):
    """``s + D R(s) = |u*|`` with R at the new speed, at speeds, depths and steps over many decades."""
    given = law.resistance(G)
    for first, h, dt in _draws():
        _, s, _, _ = moved(law, 0, h, first, dt, 1)
        assert 0 <= s <= first
        held = dt * rest_stress(given, h, h, G) / h
        if s == 0:
            assert first <= held * (1 + 1e-9)
        else:
            assert s + dt * resistance(given, s, h, G) == pytest.approx(first, rel=1e-9)
