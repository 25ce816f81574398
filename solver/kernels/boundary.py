"""The four sides of the domain: what faces on the boundary may carry, and the ledger of it."""

from __future__ import annotations

import math

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.state import NO_SLIP, OPEN, WALL, Fluxes

# What has this share of a given depth at least may be of the layer that is fed.
LAYER = 0.5


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
