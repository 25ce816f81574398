"""Uniform flow down a bed: the speed at which a law of friction balances gravity, by depth."""

from __future__ import annotations

import numpy as np

from solver.arrays import Array
from solver.physics.friction import Friction
from solver.physics.resistance import (
    BinghamProfile,
    DryTurbulent,
    Hysteretic,
    Inertial,
    Quadratic,
    Uniform,
    Viscoplastic,
    area_weighted,
)

# Depths of a table, m: between them log q is linear in log h, which is exact for powers.
DEPTHS = np.geomspace(1e-6, 1e3, 451)
# Where a yield stress or grains hold what is thinner, depths go up from there: shares that they exceed it by.
LEAST_EXCESS, EXCESSES = 1e-6, 2001
_HALVINGS, _LEAST, _MOST = 200, 1e-9, 1e6


def law_along(
    friction: Friction, gravity: float, zones: tuple[tuple[Friction, float], ...] = ()
) -> Uniform | None:
    """Resistance of a law of friction along a section; None where no normal depth is found by it.

    That is so of dry friction, which does not grow with speed, and of friction with hysteresis, by which a
    slow uniform flow has two speeds. Zones count with their shares, as they do in a cell.

    Parameters
    ----------
    gravity : float
        m s-2.
    zones : tuple of (Friction, float)
        Laws of zones that the section crosses, each with its share of the length.
    """
    found = friction.resistance(gravity)
    if zones:
        parts = [(law.resistance(gravity), np.array([share])) for law, share in zones]
        zoned = area_weighted(found, parts)
        found = type(zoned.law)(*zoned.values[:, 0].tolist())
    if isinstance(found, DryTurbulent):
        found = Quadratic(found.tangent, drag=found.drag)
    if isinstance(found, BinghamProfile):
        found = Viscoplastic(*found, 1.0)
    if isinstance(found, Hysteretic):
        return None
    driven = isinstance(found, Viscoplastic | Inertial) or found.viscous + found.drag + found.rough > 0.0
    return found if driven else None


def uniform_speed(law: Uniform, depths: Array, along: float, normal: float) -> Array:
    """Speed of uniform flow, where resistance balances gravity; same shape as ``depths``, m s-1.

    NaN where the bed holds the flow, or nothing does below 1e6 m s-1.

    Parameters
    ----------
    law : named tuple
        As `law_along` gives it.
    depths : array
        m.
    along, normal : float
        Gravity along the bed and normal to it, m s-2.
    """
    if isinstance(law, Viscoplastic):
        return _sheared(law, depths, along)
    if isinstance(law, Inertial):
        return _inertial(law, depths, along, normal)
    assert isinstance(law, Quadratic)
    low, high = np.full(depths.shape, np.log(_LEAST)), np.full(depths.shape, np.log(_MOST))
    flows = _resistance(law, np.exp(low), depths, normal) < along
    flows &= _resistance(law, np.exp(high), depths, normal) > along
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        slower = _resistance(law, np.exp(middle), depths, normal) < along
        low, high = np.where(slower, middle, low), np.where(slower, high, middle)
    return np.where(flows, np.exp(0.5 * (low + high)), np.nan)


def table_of(law: Uniform, along: float, normal: float) -> tuple[Array, Array]:
    """Depths (m) and speeds (m s-1) of uniform flow, tables of shape (n,); parameters as of `uniform_speed`.

    The tables are empty where there is no uniform flow of any depth.
    """
    speed = uniform_speed(law, DEPTHS, along, normal)
    known = np.isfinite(speed)
    first = int(np.argmax(known))
    if not known.any() or first == 0:
        return DEPTHS[known], speed[known]
    low, high = DEPTHS[first - 1], DEPTHS[first]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if np.isfinite(uniform_speed(law, np.array([middle]), along, normal)[0]):
            high = middle
        else:
            low = middle
    # the logarithm of the discharge falls without end at the depth that is held
    depths = high * (1.0 + np.geomspace(LEAST_EXCESS, DEPTHS[-1] / high, EXCESSES))
    speed = uniform_speed(law, depths, along, normal)
    known = np.isfinite(speed)
    return depths[known], speed[known]


def _resistance(law: Quadratic, s: Array, h: Array, normal: float) -> Array:
    """R(s, h) by speed (m s-1) and depth (m) of one shape, m s-2."""
    tangent, cohesion, yield_stress, viscous, drag, rough = law
    held = (1.0 - tangent) * cohesion * -np.expm1(-h * normal / cohesion) if cohesion > 0 else 0.0
    turbulent = drag * s * s / h + rough * s * s / h ** (4 / 3)
    return np.asarray(tangent * normal + (held + yield_stress) / h + viscous * s / h**2 + turbulent)


def _sheared(law: Viscoplastic, h: Array, along: float) -> Array:
    """Mean of the steady profile under the basal stress of uniform flow, ``T/rho = h g sin(xi)``."""
    y, n = law.yield_stress, law.exponent
    t = h * along
    e = t - y
    flows = e > 0
    e = np.where(flows, e, 1.0)
    t = np.where(flows, t, 1.0)
    plug = n * h / (n + 1.0) * (e / law.consistency) ** (1.0 / n) * (e / t)
    return np.where(flows, plug * (1.0 - n / (2.0 * n + 1.0) * (e / t)), np.nan)


def _inertial(law: Inertial, h: Array, along: float, normal: float) -> Array:
    """Speed at which the coefficient of friction is the slope: ``Fr = beta h/h_stop - gamma``."""
    slope = along / normal
    if not law.mu_1 < slope < law.mu_2:
        return np.full(h.shape, np.nan)
    stop = law.length * (law.mu_2 - slope) / (slope - law.mu_1)
    froude = law.beta * h / stop - law.gamma
    return np.where(froude > 0, froude * np.sqrt(normal * h), np.nan)
