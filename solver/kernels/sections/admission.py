"""What comes into the cells of a row through their faces, on lattices: added to fluxes, and taken off."""

from __future__ import annotations

import math

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.sections.inflow import HIGH_X, LOW_Y, Inflows, held_up, state_in_door
from solver.kernels.state import Fields, Fluxes


@kernel()
def admit(
    inflows: Inflows,
    e: int,
    x_fluxes: Fluxes,
    x_at: int,
    y_fluxes: Fluxes,
    low_at: int,
    high_at: int,
    h: float,
    u: float,
    v: float,
    beta_x: float,
    beta_y: float,
    dt: float,
) -> int:
    """Add what comes into a cell through its faces, from face e on, to their fluxes; return the next e.

    The fluxes that were there are kept for `dismiss`: the cells on the other side do not lose what comes in.

    Parameters
    ----------
    x_at, low_at, high_at : int
        Index of the cell's low face along x, and of its low and high face along y.
    h, u, v : float
        Depth (m) and velocity (m s-1) of the cell in this stage.
    beta_x, beta_y : float
        g cos(xi) K of the cell, m s-2.
    dt : float
        Time step, s.
    """
    cell = inflows.cell[e]
    while e < len(inflows.cell) and inflows.cell[e] == cell:
        side = inflows.side[e]
        fluxes = x_fluxes if side <= HIGH_X else y_fluxes
        at = x_at + side if side <= HIGH_X else (low_at if side == LOW_Y else high_at)
        inflows.before[0, e], inflows.before[1, e] = fluxes.mass[at], fluxes.normal[at]
        inflows.before[2, e], inflows.before[3, e] = fluxes.tangential[at], fluxes.pressure[at]
        mass, depth, speed = inflows.mass[e], inflows.depth[e], inflows.speed[e]
        flowing, passes = inflows.flowing[inflows.section[e]] > 0.0, fluxes.mass[at] != 0.0
        beta = beta_x if side <= HIGH_X else beta_y
        inside = inflows.sign[e] * (inflows.own[0, e] * u + inflows.own[1, e] * v)
        if flowing and not passes:
            # what holds up the cell above is not felt here
            fluxes.normal[at] = 0.0
        if flowing and not passes and mass <= 0.0:
            # nothing comes in so high up, and what is closed to backflow is a wall on both sides
            push = held_up(h, -inside, math.sqrt(beta * h), h, inflows.room[1, e], dt)
            fluxes.normal[at] = push * inflows.edge[e]
            fluxes.pressure[at] = 0.5 * h * h * inflows.edge[e]
        if flowing and mass > 0.0:
            along = abs(inflows.along[e])
            depth, speed = state_in_door(depth, speed, along, inside, h, beta)
            mass *= inflows.sign[e]
            pressure = 0.5 * depth * depth * inflows.edge[e]
            # what flows through the section anyhow may press more
            fluxes.pressure[at] = max(fluxes.pressure[at], pressure) if passes else pressure
            fluxes.mass[at] += mass
            fluxes.normal[at] += mass * speed * inflows.along[e]
            fluxes.tangential[at] += mass * speed * inflows.across[e]
        e += 1
    return e


@kernel()
def dismiss(
    inflows: Inflows,
    first: int,
    stop: int,
    x_fluxes: Fluxes,
    x_at: int,
    y_fluxes: Fluxes,
    low_at: int,
    high_at: int,
) -> None:
    """Put back the fluxes of faces ``first`` to ``stop`` that `admit` changed, the last one first."""
    for n in range(stop - first):
        e = stop - 1 - n
        side = inflows.side[e]
        fluxes = x_fluxes if side <= HIGH_X else y_fluxes
        at = x_at + side if side <= HIGH_X else (low_at if side == LOW_Y else high_at)
        fluxes.mass[at], fluxes.normal[at] = inflows.before[0, e], inflows.before[1, e]
        fluxes.tangential[at], fluxes.pressure[at] = inflows.before[2, e], inflows.before[3, e]


@kernel()
def admit_next(
    inflows: Inflows,
    admitted: tuple[int, int],
    stop: int,
    column: int,
    span: tuple[int, int],
    x_fluxes: Fluxes,
    y_fluxes: Fluxes,
    low_at: int,
    high_at: int,
    now: Fields,
    beta_x: Array,
    beta_y: Array,
    dt: float,
) -> tuple[int, int]:
    """Put back the fluxes around a cell of a row, and add what comes into the next one that is fed.

    Parameters
    ----------
    admitted : tuple
        First face that `admit` changed, and the one after the last.
    stop : int
        The face after the last of the row.
    column : int
        Of the cell that they are around.
    span : tuple
        Columns that are stepped.
    low_at, high_at : int
        Index of the faces below and above column 0; along x faces are numbered as those above.
    now, beta_x, beta_y, dt
        State of this stage, and the rest as of `admit`, of all cells.

    Returns
    -------
    tuple
        The faces of the next cell, as ``admitted``; both ``stop`` where there is none.
    """
    first, e = admitted
    dismiss(inflows, first, e, x_fluxes, high_at + column, y_fluxes, low_at + column, high_at + column)
    while e < stop and not span[0] <= inflows.column[e] < span[1]:
        e += 1
    if e >= stop:
        return stop, stop
    cell, c = inflows.cell[e], inflows.column[e]
    at = x_fluxes, high_at + c, y_fluxes, low_at + c, high_at + c
    return e, admit(inflows, e, *at, now.h[cell], now.u[cell], now.v[cell], beta_x[cell], beta_y[cell], dt)
