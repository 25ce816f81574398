"""The four sides of the domain: what faces on the boundary may carry, and the ledger of it."""

from __future__ import annotations

import math
from typing import NamedTuple

from solver.compiled import Array, Indices, kernel
from solver.riemann import Fluxes

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


class Sides(NamedTuple):
    """The sides x_min, x_max, y_min, y_max, arrays of shape (4,).

    kind : OPEN, WALL, NO_SLIP or DEPTH; at y_min also AXIS or MIDLINE, at y_min and y_max EVEN. depth : given
    depth, m. lean : the part of gravity along the bed that friction cannot hold there, m s-2.
    """

    kind: Indices
    depth: Array
    lean: Array


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
