"""Resistance of a Bingham or Herschel-Bulkley fluid, from the profile of a steady uniform flow.

With t the basal stress and y the yield stress, both over density, and ``e = t - y``, the depth-averaged speed
of a fluid with consistency k (over density) and flow index n is

    s(e) = n h / ((n + 1) k^(1/n)) e^(1 + 1/n) / (e + y) (1 - n e / ((2 n + 1) (e + y))),

and ``h / (3 k) e^2 (2 e + 3 y) / (2 (e + y)^2)`` for n = 1. A step of friction of duration D solves
``s(e) + D e / h = r`` for e.
"""

from __future__ import annotations

import math

from solver.compiled import kernel
from solver.kernels.resistance import loaded, resistance, rest_stress, share_left
from solver.physics.resistance import Viscoplastic

MOST_ITERATIONS = 100
# Relative change of the stress below which it has converged.
CONVERGED = 1e-14


@kernel()
def sheared_speed(e: float, y: float, h: float, law: Viscoplastic) -> float:
    """Depth-averaged speed of a steady flow, m s-1, whose basal stress exceeds yield by e, m2 s-2."""
    if e <= 0.0:
        return 0.0
    n = law.exponent
    if n == 1.0:
        return h / (3.0 * law.consistency) * (e * e) * (2.0 * e + 3.0 * y) / (2.0 * (e + y) * (e + y))
    plug = n * h / (n + 1.0) * math.pow(e / law.consistency, 1.0 / n) * (e / (e + y))
    return plug * (1.0 - n / (2.0 * n + 1.0) * (e / (e + y)))


@kernel()
def excess_stress(r: float, c: float, y: float, h: float, law: Viscoplastic) -> float:
    """Solve ``s(e) + c e = r`` for e, m2 s-2, by how much the basal stress exceeds the yield stress y.

    Parameters
    ----------
    r : float
        Speed, m s-1, above 0.
    c : float
        Time of friction over depth, s m-1, or 0.
    y, h : float
        Yield stress over density, m2 s-2, and depth, m.
    """
    return float(newton_bingham(r, c, y, h, law) if law.exponent == 1.0 else newton_power(r, c, y, h, law))


@kernel()
def newton_bingham(r: float, c: float, y: float, h: float, law: Viscoplastic) -> float:
    """Newton's method from above: the speed is a convex function of e, so that it does not overshoot."""
    a = h / (3.0 * law.consistency)
    e = (r + 0.5 * a * y) / (a + c)
    if c > 0.0 and r / c < e:
        e = r / c
    for _ in range(MOST_ITERATIONS):
        t = e + y
        f = a * (e * e) * (2.0 * e + 3.0 * y) / (2.0 * t * t) + c * e - r
        slope = a * (1.0 - y * y * y / (t * t * t)) + c
        step = f / slope
        e = e - step if step < e else 0.5 * e
        if abs(step) <= CONVERGED * e:
            break
    return e


@kernel()
def newton_power(r: float, c: float, y: float, h: float, law: Viscoplastic) -> float:
    """Newton's method for logarithms, in which powers are straight lines, with a bracket."""
    n = law.exponent
    e = law.consistency * math.pow((2.0 * n + 1.0) / (n * h) * r, n)
    e = e if e > y else y
    low, high = 0.0, math.inf
    if c > 0.0:
        high = r / c
        e = e if e < high else high
    for _ in range(MOST_ITERATIONS):
        t, speed = e + y, sheared_speed(e, y, h, law)
        total = speed + c * e
        if total < r:
            low = e
        else:
            high = e
        # logarithmic derivative of the speed
        b = n / (2.0 * n + 1.0)
        power = 1.0 + 1.0 / n - e / t - b * e * y / (t * (t - b * e))
        slope = (speed * power + c * e) / total
        new = e * math.exp(-math.log(total / r) / slope)
        if abs(new - e) <= CONVERGED * e:
            break
        # beyond the bracket it would be going round
        if not low < new < high:
            new = 0.5 * (low + high)
        e = new
    return e


@rest_stress.of(Viscoplastic)
def _(law: Viscoplastic, h: float, load: float, pressure: float) -> float:
    return float(law.yield_stress * loaded(h, load))


@resistance.of(Viscoplastic)
def _(law: Viscoplastic, speed: float, h: float, pressure: float) -> float:
    e = excess_stress(speed, 0.0, law.yield_stress, h, law) if speed > 0.0 else 0.0
    return (law.yield_stress + e) / h


@share_left.of(Viscoplastic)
def _(law: Viscoplastic, speed: float, h: float, load: float, pressure: float, time: float) -> float:
    y = law.yield_stress * loaded(h, load)
    share = sheared_speed(excess_stress(speed, time / h, y, h, law), y, h, law) / speed
    return share if share < 1.0 else 1.0
