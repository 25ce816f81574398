"""The four sides of the domain: ghost cells, what faces on the boundary may carry, and the ledger of it."""

from __future__ import annotations

import math
from typing import NamedTuple

from solver.compiled import Array, Indices, kernel
from solver.riemann import Fluxes

GHOSTS = 2
OPEN, WALL, NO_SLIP, DEPTH = 0, 1, 2, 3
# What has this share of a given depth at least may be of the layer that is fed.
LAYER = 0.5
# A flow that is its own mirror image is computed on one half: the axis goes through the outermost cells, or
# between them and their images.
AXIS, MIDLINE = 4, 5
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


class Sides(NamedTuple):
    """The sides x_min, x_max, y_min, y_max, arrays of shape (4,).

    kind : OPEN, WALL, NO_SLIP or DEPTH; at y_min also AXIS or MIDLINE. depth : given depth, m. lean : the
    part of gravity along the bed that friction cannot hold there, m s-2.
    """

    kind: Indices
    depth: Array
    lean: Array


@kernel()
def leaving_at_depth(leaving: float, h: float, depth: float, beta: float) -> float:
    """Outward velocity beyond a side of given depth, m s-1.

    What the flow inside sends out is its invariant ``leaving + 2 c``; where it is slower than its waves the
    depth outside gives the rest, up to waves that stand. Were its own velocity fed back to it instead, it
    would feed itself. What is faster than its waves goes out as it is, or comes in as the layer it is of; a
    film is of none.

    Parameters
    ----------
    leaving, h : float
        Outward velocity (m s-1) and depth (m) of the cell inside.
    depth, beta : float
        Given depth, m, and g cos(xi) K of the cell, m s-2.
    """
    inside, outside = math.sqrt(beta * h), math.sqrt(beta * depth)
    if leaving >= inside > 0.0 or (leaving < -inside and h >= LAYER * depth):
        return leaving
    return max(leaving + 2.0 * (inside - outside), -outside)


@kernel()
def leaning(h: float, rise: float) -> float:
    """Depth of a ghost beyond a wall that its image leans on, m.

    On a slope steeper than friction what lies against a wall is deeper toward it; ghosts continue the least
    such slope, since the mirror image alone would carry half of the weight and never let it rest. What is too
    thin to lean over its whole cell shows the wall no more than twice its depth, as it does other cells: the
    wall would push it off otherwise.
    """
    return min(max(0.0, h + rise), 2.0 * h)


@kernel()
def ghosts_beyond(
    h: Array, n: Array, t: Array, cell: int, outward: int, kind: int, depth: float, beta: float, rise: float
) -> None:
    """Fill the ghosts beyond one outermost cell.

    Parameters
    ----------
    h, n, t : flat arrays
        Depth, velocity along the line through the side and across it.
    cell, outward : int
        Index of the cell and distance in memory to the first ghost.
    kind : int
        OPEN continues the velocity, DEPTH the invariant; WALL, AXIS and MIDLINE mirror the normal, NO_SLIP
        both velocities.
    depth, beta : float
        Depth outside a DEPTH side, m, and g cos(xi) K of the cell, m s-2.
    rise : float
        Change of depth per spacing outward that gravity needs at a wall, m.
    """
    for k in range(GHOSTS):
        ghost, mirror = cell + (k + 1) * outward, cell - (k + 1 if kind == AXIS else k) * outward
        if kind in (WALL, NO_SLIP, AXIS, MIDLINE):
            h[ghost], n[ghost] = leaning(h[mirror], (2 * k + 1) * rise), -n[mirror]
            t[ghost] = -t[mirror] if kind == NO_SLIP else t[mirror]
        elif kind == OPEN:
            h[ghost], n[ghost], t[ghost] = h[cell], n[cell], t[cell]
        else:
            sign = 1.0 if outward > 0 else -1.0
            h[ghost], t[ghost] = depth, t[cell]
            n[ghost] = sign * leaving_at_depth(sign * n[cell], h[cell], depth, beta)


@kernel()
def fill_ghosts(
    now: Fields, beta_x: Array, beta_y: Array, sides: Sides, grid: Grid, first: int, last: int
) -> None:
    """Fill the ghost cells of rows ``first`` to ``last``, and the ghost rows near them.

    beta_x, beta_y : g cos(xi) K (eq. 7), m s-2, flat arrays of the padded lattice.
    """
    h, u, v = now
    m, rows = grid.stride, grid.rows
    kind, depth, lean = sides
    for j in range(max(first - GHOSTS, 0), min(last + GHOSTS, rows - 1) + 1):
        west, east = j * m + GHOSTS, j * m + m - GHOSTS - 1
        low, high = beta_x[west], beta_x[east]
        ghosts_beyond(h, u, v, west, -1, kind[0], depth[0], low, -lean[0] * grid.dx / low)
        ghosts_beyond(h, u, v, east, 1, kind[1], depth[1], high, lean[1] * grid.dx / high)
    if first < 2 * GHOSTS:
        for i in range(m):
            cell = GHOSTS * m + i
            ghosts_beyond(h, v, u, cell, -m, kind[2], depth[2], beta_y[cell], 0.0)
    if last >= rows - 2 * GHOSTS:
        for i in range(m):
            cell = (rows - GHOSTS - 1) * m + i
            ghosts_beyond(h, v, u, cell, m, kind[3], depth[3], beta_y[cell], 0.0)


@kernel()
def images(sides: Sides, row: int) -> float:
    """Count a padded row with its mirror image, where only one half is computed."""
    if sides.kind[2] == AXIS:
        return 1.0 if row == GHOSTS else 2.0
    return 2.0 if sides.kind[2] == MIDLINE else 1.0


@kernel()
def mirror_fluxes(fluxes: Fluxes, at: int, source: int, count: int) -> None:
    """Give the faces below the cells of an axis the mirror images of the fluxes above."""
    for k in range(count):
        fluxes.mass[at + k], fluxes.normal[at + k] = -fluxes.mass[source + k], fluxes.normal[source + k]
        fluxes.tangential[at + k] = -fluxes.tangential[source + k]
        fluxes.pressure[at + k] = fluxes.pressure[source + k]


@kernel()
def restrict(
    fluxes: Fluxes,
    at: int,
    h: Array,
    n: Array,
    t: Array,
    beta: Array,
    cell: int,
    count: int,
    kind: int,
    outward: float,
) -> None:
    """Impose on boundary faces what their side allows.

    Nothing enters through an OPEN side, and nothing passes a WALL. At a NO_SLIP side the HLL flux between the
    flow and its mirror image, whose tangential velocity is opposite, takes tangential momentum out.

    Parameters
    ----------
    fluxes, at
        Fluxes, changed in place, and the index of the first boundary face.
    h, n, t, beta : flat arrays
        Depth (m), normal and tangential velocity (m s-1), g cos(xi) K (m s-2).
    cell, count, kind : int
        Index of the first cell inside, number of faces, kind of the side.
    outward : float
        Sign of the outward direction along the face normal.
    """
    for k in range(count):
        f, i = at + k, cell + k
        if kind == OPEN and outward * fluxes.mass[f] < 0.0:
            fluxes.mass[f] = fluxes.normal[f] = fluxes.tangential[f] = 0.0
        elif kind == WALL:
            fluxes.mass[f] = fluxes.tangential[f] = 0.0
        elif kind == NO_SLIP:
            fluxes.mass[f] = 0.0
            fluxes.tangential[f] = outward * (abs(n[i]) + math.sqrt(beta[i] * h[i])) * h[i] * t[i]


@kernel()
def account(mass: Array, at: int, count: int, outward: float, share: float, ledger: Array) -> None:
    """Add what boundary faces carry to the ledger.

    Parameters
    ----------
    mass : flat array
        Flux of depth, m2 s-1, the first face at index ``at``.
    outward : float
        Sign of the outward direction.
    share : float
        Face length times the stage's share of the time step, m s.
    ledger : (2,) array
        Volumes that came in and left, m3, changed in place.
    """
    for k in range(at, at + count):
        leaving = outward * mass[k]
        if leaving > 0.0:
            ledger[1] += share * leaving
        else:
            ledger[0] -= share * leaving
