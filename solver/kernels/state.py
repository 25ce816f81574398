"""What kernels are given: the state of a run, its bed, material and sides, and their constants."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.compiled import kernel
from solver.physics.resistance import Resistance
from solver.referenced import by_reference

# Share of its depth that the positivity limiter leaves a cell in a stage, so that round-off cannot make it
# negative.
RETAINED = 1e-12

# Round-off allowed where a drive exactly at the friction limit is below yield (slope = friction angle).
YIELD_TOLERANCE = 1.0 + 1e-12

# What has no more than this share of the depth up to which cells count as dry never moves.
STILL = 1e-4

# Why a cell is static: it is dry, or at rest and below the yield limit of friction.
DRY, BELOW_YIELD = 1.0, 2.0

GHOSTS = 2
OPEN, WALL, NO_SLIP, DEPTH = 0, 1, 2, 3
# A flow that is its own mirror image is computed on one half: the axis goes through the outermost cells, or
# between them and their images.
AXIS, MIDLINE = 4, 5
# One row stands for all rows of a flow that does not vary across the slope: nothing passes between them.
EVEN = 6
# Runs of cells are computed in whole vectors of this many where possible: what is left over is slow.
LANES = 8


class Grid(NamedTuple):
    """The padded lattice: number of rows, length of a row in memory, spacings in m."""

    rows: int
    stride: int
    dx: float
    dy: float


class Fields(NamedTuple):
    """Depth (m) and velocity (m s-1), flat arrays of the padded lattice."""

    h: Array
    u: Array
    v: Array


@by_reference
class Sides(NamedTuple):
    """The sides x_min, x_max, y_min, y_max, arrays of shape (4,).

    Attributes
    ----------
    kind
        OPEN, WALL, NO_SLIP or DEPTH; at y_min also AXIS or MIDLINE, at y_min and y_max EVEN.
    depth
        Given depth, m.
    excess
        Excess driving acceleration there: what gravity along the bed has over dry friction, with its sign,
        m s-2.
    first, fastest
        Inward speed that a layer beyond a DEPTH side has at most, m s-1: at the start and, by `drive_layers`,
        now.
    driving
        What gravity along the bed has over dry friction in the domain at most, m s-2: along x, against it,
        and the same for y.
    alongside
        Speed along a DEPTH side that a layer beyond it has at most now, m s-1, in the same directions.
    """

    kind: Indices
    depth: Array
    excess: Array
    first: Array
    fastest: Array
    driving: Array
    alongside: Array


class Fluxes(NamedTuple):
    """Fluxes through faces, flat arrays.

    Attributes
    ----------
    mass
        Of depth, m2 s-1.
    normal, tangential
        Convective, of h n and h t, m3 s-2.
    pressure
        HLL mean of h^2 / 2, m2, to be multiplied by the beta of the cell that feels it.
    """

    mass: Array
    normal: Array
    tangential: Array
    pressure: Array


class FaceValues(NamedTuple):
    """Depth (m), normal and tangential velocity (m s-1) at the low and high face of cells; flat arrays.

    Attributes
    ----------
    c
        Wave speed sqrt(beta h) of the cells, m s-1.
    """

    h_low: Array
    h_high: Array
    n_low: Array
    n_high: Array
    t_low: Array
    t_high: Array
    c: Array


class Bed(NamedTuple):
    """Along x, padded shape (nx + 4,): g sin xi, g cos xi (m s-2), the curvature kappa (m-1).

    Attributes
    ----------
    falling
        Wave rate (s-1) that gives the longest step from rest, from `falling_rate`.
    steepness
        That of the material's transition over ``sqrt(g cos xi)``, s m-1/2.
    """

    along: Array
    normal: Array
    curvature: Array
    falling: Array
    steepness: Array


class Material(NamedTuple):
    """Friction and its limits.

    Attributes
    ----------
    law
        Of basal friction, whose class chooses the kernels of `solver.kernels.friction`.
    pressure
        The six earth-pressure coefficients, in the order of `PressureCoefficients`.
    transition
        Between the limiting states, in the order of `Transition`.
    dry
        Depth up to which a cell counts as dry and does not move, m.
    """

    law: Resistance
    pressure: tuple[float, float, float, float, float, float]
    transition: tuple[float, float, float]
    dry: float


class Status(NamedTuple):
    """What each cell is in this step, flat arrays of the padded lattice.

    Attributes
    ----------
    beta_x, beta_y
        Earth pressure, g cos(xi) K (eq. 7), m s-2.
    static
        DRY, or BELOW_YIELD at rest, else 0.
    beta_xy
        g cos(xi) K_xy, m s-2, where the axes of the pressure are those of the flow; None elsewhere.
    """

    beta_x: Array
    beta_y: Array
    static: Array
    beta_xy: Array | None = None


class Lift(NamedTuple):
    """What the cells of a cloud have on a surface beside what they have on a slope profile, each (cells,).

    Attributes
    ----------
    across
        Gravity along e2, m s-2.
    k_12, k_22
        Normal curvature, m-1; that along e1 is ``curvature`` of `CloudBed`.
    p, r, q
        As of `solver.surface.metric.Metric`.
    drain
        1 + number of the side that takes what comes to a cell of which nothing is known, 0 for none.
    """

    across: Array
    k_12: Array
    k_22: Array
    p: Array
    r: Array
    q: Array
    drain: NDArray[np.int8]


class CloudBed(NamedTuple):
    """At each cell: g sin xi, g cos xi (m s-2), the curvature kappa (m-1), and a rate as in `Bed`.

    On a surface gravity and curvature are those along e1, and ``lift`` has the others; elsewhere it is None.
    """

    along: Array
    normal: Array
    curvature: Array
    falling: Array
    lift: Lift | None = None


@kernel(inline=True)
def may_flow(h: float, u: float, v: float, dry: float) -> bool:
    """Whether a cell is not dry, or a film that moves beside a flow (`share_of_speed`)."""
    return (h > dry) | (u != 0.0) | (v != 0.0)


@kernel(inline=True)
def square_above(h: float, u: float, v: float, dry: float) -> float:
    """Square of the speed of a cell that is not dry, m2 s-2; 0 of a dry one."""
    return u * u + v * v if h > dry else 0.0


@kernel()
def share_of_speed(u: float, v: float, most: float) -> float:
    """Share of its velocity that a film keeps: it is as fast as a deeper cell beside it at most.

    Parameters
    ----------
    u, v : float
        Velocity of the film, m s-1.
    most : float
        Largest square of the speed of the cells beside it, from `square_above`, m2 s-2.
    """
    square = u * u + v * v
    if most == 0.0:
        return 0.0
    # what is bound once stays as it is: a window that has to grow finds the state of a step twice
    return math.sqrt(most / square) if square > most * YIELD_TOLERANCE else 1.0


@kernel()
def whole(count: int) -> int:
    """Round a number of cells up to whole vectors, for runs that only fill buffers."""
    return -(-count // LANES) * LANES
