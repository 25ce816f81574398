"""What the kernels are given of a law of basal friction: one named tuple for each form of resistance.

Resistance is an acceleration ``R(s, h) = tau_b / (rho h)``, s the speed and h the depth. N is the normal
load, ``max(0, g cos xi + kappa u^2)``. Stresses are divided by the density of the flow. A kernel is compiled
for the tuples that it is given, so that a law that is not used costs nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

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


class BinghamProfile(NamedTuple):
    """R h is the basal stress of a Bingham fluid whose depth-averaged steady speed is s.

    Attributes
    ----------
    yield_stress
        tau_y over density, m2 s-2.
    viscosity
        Over density, m2 s-1.
    """

    yield_stress: float
    viscosity: float


class Viscoplastic(NamedTuple):
    """R h is the basal stress of a Herschel-Bulkley fluid whose depth-averaged steady speed is s.

    Attributes
    ----------
    yield_stress
        tau_y over density, m2 s-2.
    consistency
        K over density, m2 s^(n - 2).
    exponent
        Flow index n.
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
    length
        Depth over which friction changes, m.
    beta, gamma
        The depth-averaged flow rule is ``Fr = beta h/h_stop - gamma``.
    """

    mu_1: float
    mu_2: float
    length: float
    beta: float
    gamma: float


class Hysteretic(NamedTuple):
    """The same with hysteresis: what is at rest holds more than what moves.

    Attributes
    ----------
    mu_1, mu_2, length, beta, gamma
        As of `Inertial`.
    mu_3
        Friction coefficient at which a deep layer starts to move.
    beta_star
        Froude number below which friction weakens with speed, above 0.
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


Uniform = DryTurbulent | Quadratic | BinghamProfile | Viscoplastic | Inertial | Hysteretic


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


EXPONENTS: dict[type, tuple[str, ...]] = {Viscoplastic: ("exponent",), Hysteretic: ("kappa",)}
"""Fields that have no mean: with another exponent the other parameters have other units or meanings."""


def in_one_form(laws: Sequence[Uniform]) -> list[Uniform]:
    """Give laws in one form: dry friction with turbulent drag is quadratic beside what is.

    Raises
    ------
    ValueError
        If they have none.
    """
    found = list(laws)
    if any(isinstance(each, Quadratic) for each in found):
        found = [
            Quadratic(each.tangent, drag=each.drag) if isinstance(each, DryTurbulent) else each
            for each in found
        ]
    if len(set(map(type, found))) > 1:
        raise ValueError("zones must be of the same law of friction")
    return found


def shares_of_zones(
    zones: Sequence[tuple[object, ArrayLike]], law: object, shape: tuple[int, ...], of: str
) -> list[Array]:
    """Give the shares of the cells that zones cover, once these fit the points and the law around them.

    Parameters
    ----------
    zones : sequence
        Law and shares of each.
    law : object
        Where nothing else is said.
    shape : tuple of int
        Of the points.
    of : str
        What the law is of, for messages.

    Raises
    ------
    ValueError
        If shares are of another shape, or a zone of another law.
    """
    for zone, share in zones:
        if np.shape(share) != shape:
            raise ValueError(f"shares of a zone must have the points' shape {shape}")
        if type(zone) is not type(law):
            raise ValueError(f"zones must be of the same law of {of}")
    return [np.asarray(share, np.float64) for _, share in zones]


def area_weighted(law: Uniform, parts: Sequence[tuple[Uniform, Array]]) -> Zoned:
    """Give a law with its parameters at each cell, `area_means` of those of its parts.

    What the fields hold is what resistance is linear in: mu, 1/xi, n^2, 1/C^2, tau_y; means of the others
    are between what they are means of.

    Parameters
    ----------
    law : named tuple
        Where nothing else is said.
    parts : sequence
        Laws in its form, each with the share of the area of each cell that it holds in, of one shape.

    Raises
    ------
    ValueError
        If forms differ, or shares add up to more than 1.
    """
    own, *others = in_one_form([law, *(each for each, _ in parts)])
    kept = [own._fields.index(name) for name in EXPONENTS.get(type(own), ())]
    shares = [share for _, share in parts]
    return Zoned(own, area_means(own, list(zip(others, shares, strict=True)), kept))


def area_means(
    own: Sequence[float], parts: Sequence[tuple[Sequence[float], Array]], exponents: Sequence[int] = ()
) -> Array:
    """Give the parameters at each cell, means over its area, (fields, *shape).

    Where exponents differ a cell has those that hold in most of it, and means of the parts that have them; of
    equal parts the later one counts.

    Parameters
    ----------
    own : sequence of float
        Parameters where nothing else is said.
    parts : sequence
        Parameters, each with the share of the area of each cell that they hold in, of one shape.
    exponents : sequence of int
        Numbers of the fields that have no mean.

    Raises
    ------
    ValueError
        If shares add up to more than 1.
    """
    rest: Array = np.asarray(1.0 - sum(share for _, share in parts), dtype=np.float64)
    if (rest < -1e-9).any():
        raise ValueError("zones must not overlap")
    held = [np.array(own, dtype=np.float64), *(np.array(each, dtype=np.float64) for each, _ in parts)]
    shares = [np.maximum(rest, 0.0), *(share for _, share in parts)]
    powers = [tuple(each[list(exponents)]) for each in held]
    if len(set(powers)) > 1:
        shares = _of_most(powers, shares)
    found: Array = np.multiply.outer(held[0], shares[0])
    for each, share in zip(held[1:], shares[1:], strict=True):
        found += np.multiply.outer(each, share)
    # what no zone touches, or one fills, has its parameters to the last bit
    for each, share in zip(held, shares, strict=True):
        found[:, share == 1.0] = each[:, None]
    for field in exponents:
        for each, share in zip(held, shares, strict=True):
            found[field, share > 0.0] = each[field]
    return found


def _of_most(powers: Sequence[tuple[float, ...]], shares: Sequence[Array]) -> list[Array]:
    """Shares of parts in what those of a cell take up that have the exponents of most of it."""
    totals = {
        power: sum(share for other, share in zip(powers, shares, strict=True) if other == power)
        for power in powers
    }
    most = np.zeros(np.shape(shares[0]))
    for total in totals.values():
        most = np.maximum(most, total)
    last = np.zeros(np.shape(shares[0]), dtype=int)
    for i, total in enumerate(totals.values()):
        last[total == most] = i
    number = {power: i for i, power in enumerate(totals)}
    return [
        np.where(last == number[power], share / most, 0.0)
        for power, share in zip(powers, shares, strict=True)
    ]
