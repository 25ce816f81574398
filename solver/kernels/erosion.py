"""Erosion of the bed in a cell, a split after the whole time step: ``h += de`` at the same ``h u`` (E1)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.arrays import Array
from solver.compiled import by_type, kernel
from solver.kernels.friction import law_at, resistance
from solver.kernels.resistance import Index
from solver.kernels.runge_kutta import added
from solver.kernels.source_terms import Cell
from solver.kernels.state import Material
from solver.physics.erosion import (
    EGASHIRA,
    GROWTH_RATE,
    SHEAR_STRESS,
    SHEAR_WORK,
    ErodibleBed,
    ShearStress,
)
from solver.physics.resistance import Uniform
from solver.referenced import by_reference


class Everywhere(NamedTuple):
    """Coefficients of a law of erosion that hold in all cells."""

    one: float
    two: float
    three: float


class InCells(NamedTuple):
    """Coefficients of a law of erosion at each cell, ``values`` (3, cells)."""

    values: Array


@by_type
def coefficients_at(coefficients: Everywhere | InCells, i: Index) -> Everywhere:
    """Coefficients of the law of erosion in the cell with number i."""
    raise NotImplementedError


@coefficients_at.of(Everywhere)
def _(coefficients: Everywhere, i: Index) -> Everywhere:
    return coefficients


@coefficients_at.of(InCells)
def _(coefficients: InCells, i: Index) -> Everywhere:
    values = coefficients.values
    return Everywhere(values[0, i], values[1, i], values[2, i])


@by_reference
class Erosion(NamedTuple):
    """The erodible bed of a run; its arrays are empty where there is none.

    Attributes
    ----------
    law
        Number of the law, from `solver.physics.erosion`.
    coefficients
        What the law gives, for all cells or each of them.
    by_friction
        1 where the stress of `SHEAR_STRESS` is that of friction, 0 where it is of depth and slope.
    minimum_depth, minimum_speed
        Depth (m) and speed (m s-1) up to which nothing is eroded.
    available
        Depth that may be eroded in each cell, m.
    eroded
        Depth that has been eroded, m.
    entrained
        (2,), volume that the flow has taken up, m3: a sum, and what rounding has taken from it.
    """

    law: int
    coefficients: Everywhere | InCells
    by_friction: int
    minimum_depth: float
    minimum_speed: float
    available: Array
    eroded: Array
    entrained: Array


def erosion_of(
    bed: ErodibleBed | None,
    available: Array,
    eroded: Array,
    entrained: Array,
    coefficients: Array | None = None,
) -> Erosion:
    """Give the kernels an erodible bed; without one the arrays are to be empty.

    ``coefficients`` are those at each cell, (3, cells), where there are zones.
    """
    if bed is None:
        return Erosion(0, Everywhere(0.0, 0.0, 0.0), 0, 0.0, 0.0, available, eroded, entrained)
    law, limits = bed.law, bed.limits
    by_friction = int(isinstance(law, ShearStress) and law.stress == "friction")
    everywhere = Everywhere(*map(float, law.coefficients()))
    return Erosion(
        law.number,
        everywhere if coefficients is None else InCells(coefficients),
        by_friction,
        float(limits.minimum_depth),
        float(limits.minimum_speed),
        available,
        eroded,
        entrained,
    )


def no_erosion() -> Erosion:
    """Give the kernels a bed that does not erode."""
    return erosion_of(None, np.zeros(0), np.zeros(0), np.zeros(2))


@kernel(inline=True)
def entrain(volume: float, entrained: Array) -> None:
    """Add to ``entrained`` of `Erosion` a volume that the flow takes up, m3."""
    entrained[0], entrained[1] = added(entrained[0], entrained[1], volume)


@kernel(fastmath=False, inline=True)
def eroding_depth(
    erosion: Erosion,
    i: int,
    h: float,
    speed: float,
    pull: float,
    gravity: float,
    load: float,
    done: float,
    dt: float,
    law: Uniform,
) -> float:
    """Depth that a law takes from the bed in dt (s), whatever there is, m (E2 to E6); 0 or less for nothing.

    Parameters
    ----------
    i : int
        Index of the cell in the arrays of ``erosion``.
    h, speed : float
        Depth (m) and speed (m s-1) of the flow, of which the product does not change.
    pull : float
        Gravity in the direction of motion, m s-2, negative where the flow climbs.
    gravity : float
        g, m s-2.
    load : float
        Normal load over density and depth, N, m s-2.
    done : float
        Depth eroded so far, m.
    law : named tuple
        Of basal friction, in this cell.
    """
    one, two, three = coefficients_at(erosion.coefficients, i)
    taken: float
    friction = h * resistance(law, speed, h, load)
    if erosion.law == GROWTH_RATE:
        taken = one * (h * speed) * dt
    elif erosion.law == SHEAR_STRESS:
        stress = friction if erosion.by_friction != 0 else h * pull
        left, most = two * (stress - three) - done, one * dt
        taken = left if left < most else most
    elif erosion.law == SHEAR_WORK:
        taken = one * friction * speed * dt
    elif erosion.law == EGASHIRA:
        across = gravity * gravity - pull * pull
        slope = pull / math.sqrt(across) if across > 0.0 else math.inf
        steeper = (slope - one) / (1.0 + slope * one) if slope < math.inf else 1.0 / one
        gain = 2.0 * (h * speed) * dt * steeper if slope > one else 0.0
        taken = gain / (math.sqrt(h * h + gain) + h)
    else:
        strength = two + one * load * h
        taken = (friction - strength) * dt / (three * speed)
    return taken


@kernel(fastmath=False)
def erode_cell(
    erosion: Erosion,
    i: int,
    cell: Cell,
    gravity: tuple[float, float, float],
    load: float,
    dt: float,
    material: Material,
) -> tuple[float, float, float, float]:
    """Erode below one cell that is not static; give its depth and velocity, and the depth taken up, m.

    Parameters
    ----------
    i : int
        Index of the cell in the arrays of ``erosion``, which are changed in place.
    cell : tuple
        Depth (m) and velocity (m s-1).
    gravity : tuple
        Along both components of the velocity and normal to the bed, m s-2.
    load : float
        ``max(0, g cos xi + kappa u^2)``, m s-2.
    dt : float
        Time step, s.
    """
    h, u, v = cell
    most, done = erosion.available[i], erosion.eroded[i]
    if not (done < most and h > erosion.minimum_depth):
        return h, u, v, 0.0
    speed = math.sqrt(u * u + v * v)
    if not speed > erosion.minimum_speed:
        return h, u, v, 0.0
    g_1, g_2, g_n = gravity
    pull = (g_1 * u + g_2 * v) / speed
    whole = math.sqrt(g_1 * g_1 + g_2 * g_2 + g_n * g_n)
    wanted = eroding_depth(erosion, i, h, speed, pull, whole, load, done, dt, law_at(material.law, i))
    if not wanted > 0.0:
        return h, u, v, 0.0
    # the flow gains what the bed loses as it is written, round-off included
    after = done + wanted
    after = after if after < most else most
    gained = after - done
    erosion.eroded[i] = after
    keeps = h / (h + gained)
    return h + gained, u * keeps, v * keeps, gained
