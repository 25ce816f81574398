"""Steps of friction of Bingham and Herschel-Bulkley fluids: the equation they solve, by another method."""

import numpy as np
import pytest

from solver.kernels.friction import resistance, share_left
from solver.physics.resistance import BinghamProfile, Viscoplastic

NORMAL = 9.81
EXPONENTS = (0.1, 0.25, 1 / 3, 0.4, 0.5, 0.7, 0.999, 1.0, 1.5, 2.0)


# A Bingham fluid has kernels of its own, and is a Herschel-Bulkley fluid of index 1 too.
FLUIDS = [
    *(pytest.param(n, lambda y, k, n=n: Viscoplastic(y, k, n), id=f"n={n:.3g}") for n in EXPONENTS),
    pytest.param(1.0, BinghamProfile, id="Bingham"),
]


def steady_speed(e, y, h, law):
    """Depth-averaged speed of a steady flow whose basal stress over density exceeds yield by e."""
    _, consistency, n = law if isinstance(law, Viscoplastic) else (*law, 1.0)
    t = e + y
    plug = n * h / (n + 1) * (e / consistency) ** (1 / n) * e / t
    return plug * (1 - n / (2 * n + 1) * e / t)


def bisected(r, c, y, h, law):
    """Excess stress of ``s(e) + c e = r``, by halving the interval of its logarithm."""
    low, high = -200.0, 200.0
    while high - low > 1e-14 * max(1.0, abs(low)):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        e = np.exp(middle)
        with np.errstate(all="ignore"):
            above = steady_speed(e, y, h, law) + c * e > r
        low, high = (low, middle) if above else (middle, high)
    return np.exp(0.5 * (low + high))


@pytest.mark.parametrize(("exponent", "fluid"), FLUIDS)
def test_a_step_leaves_the_speed_that_solves_its_equation(exponent, fluid):
    rng = np.random.default_rng(7)
    for _ in range(150):
        y, k, h = (10 ** rng.uniform(*span) for span in ((-4, 3), (-4, 2), (-4, 1.5)))
        speed, time = 10 ** rng.uniform(-6, 2), 10 ** rng.uniform(-8, 2)
        law = fluid(y * (rng.random() > 0.1), k)
        e = bisected(speed, time / h, law.yield_stress, h, law)
        left = steady_speed(e, law.yield_stress, h, law)
        found = share_left(law, speed, h, h, NORMAL, time) * speed
        # a speed is as exact as a power 1 + 1/n of a stress can be
        assert found == pytest.approx(left, rel=2e-12 / exponent)
        assert 0 < found <= speed


@pytest.mark.parametrize(("exponent", "fluid"), FLUIDS)
def test_resistance_is_that_of_the_steady_flow_of_the_same_speed(exponent, fluid):
    for y in (0.0, 1e-3, 0.5, 50.0):
        law = fluid(y, 0.2)
        for h, speed in ((0.01, 1e-6), (0.3, 0.5), (2.0, 30.0)):
            e = resistance(law, speed, h, NORMAL) * h - y
            # what a yield stress far above leaves of the digits of e
            digits = 1e-12 + 4e-16 * y / e
            assert steady_speed(e, y, h, law) == pytest.approx(speed, rel=digits * (1 + 1 / exponent))


def test_a_film_and_a_long_step_leave_a_speed_that_balances_the_stress():
    # nearly all of the speed goes into the stress: e = r h/D
    law = Viscoplastic(0.5, 0.2, 0.5)
    left = share_left(law, 1e-3, 1e-4, 1e-4, NORMAL, 10.0) * 1e-3
    assert left == pytest.approx(steady_speed(1e-8, 0.5, 1e-4, law), rel=1e-6)
