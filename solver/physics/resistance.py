"""What the kernels are given of a law of basal friction: one named tuple for each form of resistance.

Resistance is an acceleration ``R(s, h) = tau_b / (rho h)``, s the speed and h the depth. N is the normal
load, ``max(0, g cos xi + kappa u^2)``. Stresses are divided by the density of the flow. A kernel is compiled
for the tuples that it is given, so that a law that is not used costs nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solver.arrays import Array


class DryTurbulent(NamedTuple):
    """R = tangent N + drag s^2/h.

    Attributes
    ----------
    tangent
        Coefficient of dry friction, tan(delta).
    drag
        Coefficient of turbulent drag, g / turbulent friction, 0 for dry friction, dimensionless.
    """

    tangent: float
    drag: float


class Quadratic(NamedTuple):
    """R = tangent N + (cohesion part + yield_stress)/h + viscous s/h^2 + drag s^2/h + rough s^2/h^(4/3).

    The cohesion part is ``(1 - tangent) cohesion (1 - exp(-h N / cohesion))``.

    Attributes
    ----------
    tangent
        Coefficient of dry friction, tan(delta).
    cohesion, yield_stress
        Stresses over density, m2 s-2.
    viscous
        Coefficient of viscous resistance, m2 s-1.
    drag
        Coefficient of turbulent drag, dimensionless.
    rough
        Manning's g n^2, m1/3.
    """

    tangent: float = 0.0
    cohesion: float = 0.0
    yield_stress: float = 0.0
    viscous: float = 0.0
    drag: float = 0.0
    rough: float = 0.0


class Viscoplastic(NamedTuple):
    """R h is the basal stress of a Herschel-Bulkley fluid whose depth-averaged steady speed is s.

    Attributes
    ----------
    yield_stress
        tau_y over density, m2 s-2.
    consistency
        K over density, m2 s^(n - 2); of a Bingham fluid the viscosity over density.
    exponent
        Flow index n, 1 for a Bingham fluid.
    """

    yield_stress: float
    consistency: float
    exponent: float


class Inertial(NamedTuple):
    """R = mu N, mu a function of the Froude number s/sqrt(N h) and of the depth.

    Attributes
    ----------
    mu_1, mu_2
        Friction coefficients of a slow and of a fast flow.
    mu_3
        That at which a deep layer starts to move, with hysteresis.
    length
        Depth over which friction changes, m.
    beta, gamma
        The depth-averaged flow rule is ``Fr = beta h/h_stop - gamma``.
    beta_star
        Froude number below which friction weakens with speed, 0 without hysteresis.
    kappa
        Exponent of the transition from static to dynamic friction.
    """

    mu_1: float
    mu_2: float
    mu_3: float
    length: float
    beta: float
    gamma: float
    beta_star: float
    kappa: float


Uniform = DryTurbulent | Quadratic | Viscoplastic | Inertial


class Zoned(NamedTuple):
    """A law whose parameters differ between cells.

    Attributes
    ----------
    law
        One of the others, whose class is that of all cells.
    values
        Its parameters at each cell, in the order of its fields, shape (fields, cells).
    """

    law: Uniform
    values: Array


Resistance = Uniform | Zoned


def area_weighted(law: Uniform, parts: list[tuple[Uniform, Array]]) -> Array:
    """Give the parameters of a law at each cell, means over its area, (fields, *shape).

    What the fields hold is what resistance is linear in: mu, 1/xi, n^2, 1/C^2, tau_y.

    Parameters
    ----------
    law : named tuple
        Where nothing else is said.
    parts : list
        Laws of the same class, each with the share of the area of each cell that it holds in, of one shape.

    Raises
    ------
    ValueError
        If classes differ, or shares add up to more than 1.
    """
    rest: Array = np.asarray(1.0 - sum(share for _, share in parts), dtype=np.float64)
    if any(type(each) is not type(law) for each, _ in parts):
        raise ValueError("zones must be of the same law of friction")
    if (rest < -1e-9).any():
        raise ValueError("zones must not overlap")
    found: Array = np.multiply.outer(np.array(law, dtype=np.float64), np.maximum(rest, 0.0))
    for each, share in parts:
        found += np.multiply.outer(np.array(each, dtype=np.float64), share)
    # what no zone touches, or one fills, has its parameters to the last bit
    found[:, rest == 1.0] = np.array(law, dtype=np.float64)[:, None]
    for each, share in parts:
        found[:, share == 1.0] = np.array(each, dtype=np.float64)[:, None]
    return found
