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
from solver.elementary import exponential, logarithm
from solver.kernels.resistance import loaded, resistance, rest_stress, share_left
from solver.physics.resistance import BinghamProfile, Viscoplastic

# Change of the logarithm of e that no step exceeds.
LONGEST = 2.0
# Up to this ratio of difference and sum a series gives a logarithm.
SMALL = 0.3


@kernel(inline=True)
def bingham(r: float, c: float, y: float, h: float, viscosity: float) -> tuple[float, float]:
    """Solve ``s(e) + c e = r`` where n is 1, without a branch: a loop of it is computed in whole vectors.

    It starts from ``s = 1.5 a e^2/(y + 1.5 e)``, ``a = h/(3 k)``, which is right for small e and for y = 0.
    The last step gives s too, which has all its digits where r - c e would have lost them.

    Parameters
    ----------
    r : float
        Speed, m s-1, above 0.
    c : float
        Time of friction over depth, s m-1, or 0.
    y, h : float
        Yield stress over density, m2 s-2, and depth, m.
    viscosity : float
        Over density, m2 s-1.

    Returns
    -------
    tuple
        e, m2 s-2, by which the basal stress exceeds yield, and s, m s-1.
    """
    a = h / (3.0 * viscosity)
    square, linear = 1.5 * (a + c), c * y - 1.5 * r
    root = math.sqrt(linear * linear + 4.0 * square * (r * y))
    # the positive root, without cancellation
    e = (root - linear) / (2.0 * square) if linear < 0.0 else 2.0 * r * y / (root + linear)
    # it starts within 4 %; a loop of these within that over cells would not be computed in whole vectors
    e, _ = halley(e, r, c, y, a)
    e, s = halley(e, r, c, y, a)
    return e, s


@kernel(inline=True)
def halley(e: float, r: float, c: float, y: float, a: float) -> tuple[float, float]:
    """Take a step of Halley's method for `bingham`, which cubes the error; give e and s."""
    over = 1.0 / (e + y)
    held = y * over
    cubed = held * held * held
    s = 0.5 * a * (e * e) * (2.0 * e + 3.0 * y) * (over * over)
    first, second = a * (1.0 - cubed), 3.0 * a * cubed * over
    slope, excess = first + c, s + c * e - r
    step = -excess * slope / (slope * slope - 0.5 * excess * second)
    return e + step, s + step * (first + 0.5 * step * second)


@kernel(inline=True)
def power_law(r: float, c: float, y: float, h: float, law: Viscoplastic) -> tuple[float, float]:
    """Do what `bingham` does for any n: Halley's method for logarithms, in which powers are lines.

    It starts between the powers that s is of small and of large e.
    """
    n, k = law.exponent, law.consistency
    a, b, scale = 1.0 / n, n / (2.0 * n + 1.0), n * h / (n + 1.0)
    ln_s, ln_k = logarithm(r / scale), logarithm(k)
    e = exponential(ln_k + n * (ln_s - logarithm(1.0 - b)))
    small = exponential((n * (ln_s + logarithm(y)) + ln_k) / (n + 1.0))
    # right within 1 % where e is y, for n from 0.1 to 2
    between = math.sqrt(e * e + small * small - (1.0 - 1.45 * n) * (e * small))
    e = between if y > 0.0 else e
    # of which c takes a part
    part = c * e / r
    less = 2.0 / (part + math.sqrt(part * part + 4.0))
    e *= (a + 0.5) / (a + 0.5 + part) if part < 1.0 else less
    fluid = scale * exponential(a * logarithm(e / k))
    # it starts within 70 %, the last step within 4e-4; a loop would not be computed in whole vectors
    e, fluid = scaled(e, fluid, a, halley_of_logarithms(e, fluid, r, c, y, a, b, True)[0])
    e, fluid = scaled(e, fluid, a, halley_of_logarithms(e, fluid, r, c, y, a, b, False)[0])
    e, fluid = scaled(e, fluid, a, halley_of_logarithms(e, fluid, r, c, y, a, b, False)[0])
    step, s, first, second = halley_of_logarithms(e, fluid, r, c, y, a, b, False)
    e *= 1.0 + step * (1.0 + 0.5 * step)
    return e, s + step * (first + 0.5 * step * second * (1.0 + a * step / 3.0))


@kernel(inline=True)
def scaled(e: float, fluid: float, a: float, step: float) -> tuple[float, float]:
    """Give e and its power a, times what the latter is multiplied by, where the logarithm of e is larger."""
    step = min(max(step, -LONGEST), LONGEST)
    return e * exponential(step), fluid * exponential(a * step)


@kernel(inline=True)
def halley_of_logarithms(
    e: float, fluid: float, r: float, c: float, y: float, a: float, b: float, far: bool
) -> tuple[float, float, float, float]:
    """Give the step of the logarithm of e, s, and the derivatives of s by this logarithm.

    ``far`` says whether s + c e may be more than twice r, or less than half of it.
    """
    t = e / (e + y)
    plug, flat = 1.0 - t, 1.0 - 2.0 * b * t
    # s is fluid times this, whose derivative by the logarithm of e is the next
    shape = t * (1.0 - b * t)
    turn = t * plug * flat
    s = fluid * shape
    first = fluid * (a * shape + turn)
    second = fluid * (a * (a * shape + 2.0 * turn) + t * plug * ((1.0 - 2.0 * t) * flat - 2.0 * b * t * plug))
    # of s + c e, and of its logarithm
    drag = c * e
    total, slope, curvature = s + drag, first + drag, second + drag
    excess = logarithm_of_ratio(total, r)
    if far and abs(total - r) > SMALL * (total + r):
        excess = logarithm(total / r)
    bend = slope * slope - 0.5 * excess * (curvature * total - slope * slope)
    return -excess * (slope * total) / bend, s, first, second


@kernel(inline=True)
def logarithm_of_ratio(x: float, one: float) -> float:
    """Logarithm of x/one: all digits where they differ by 1e-2 or less, within 1e-4 up to a factor of 2."""
    ratio = (x - one) / (x + one)
    square = ratio * ratio
    return 2.0 * ratio * (1.0 + square * (1.0 / 3.0 + square * (0.2 + square / 7.0)))


@rest_stress.of(BinghamProfile, Viscoplastic)
def _(law: BinghamProfile | Viscoplastic, h: float, load: float, pressure: float) -> float:
    return float(law.yield_stress * loaded(h, load))


@resistance.of(BinghamProfile)
def _(law: BinghamProfile, speed: float, h: float, pressure: float) -> float:
    e = 0.0
    if speed > 0.0:
        e, _ = bingham(speed, 0.0, law.yield_stress, h, law.viscosity)
    return (law.yield_stress + e) / h


@resistance.of(Viscoplastic)
def _(law: Viscoplastic, speed: float, h: float, pressure: float) -> float:
    e = 0.0
    if speed > 0.0:
        e, _ = power_law(speed, 0.0, law.yield_stress, h, law)
    return (law.yield_stress + e) / h


@share_left.of(BinghamProfile)
def _(law: BinghamProfile, speed: float, h: float, load: float, pressure: float, time: float) -> float:
    _, left = bingham(speed, time / h, law.yield_stress * loaded(h, load), h, law.viscosity)
    share = left / speed
    return share if share < 1.0 else 1.0


@share_left.of(Viscoplastic)
def _(law: Viscoplastic, speed: float, h: float, load: float, pressure: float, time: float) -> float:
    _, left = power_law(speed, time / h, law.yield_stress * loaded(h, load), h, law)
    share = left / speed
    return share if share < 1.0 else 1.0
