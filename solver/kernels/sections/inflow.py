"""What comes in through sections: its volume in a step, its depth and speed, and the faces it passes.

The flux of mass through a section is the exact increment of its cumulated hydrograph, the same in all stages.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.arrays import Array, Indices
from solver.compiled import kernel
from solver.inflow.hydrograph_kernels import (
    Hydrographs,
    depth_of,
    next_flow,
    no_hydrographs,
    peak_within,
    unit_discharge,
    volume_until,
)
from solver.kernels.boundary import stopped, wall_flux
from solver.kernels.runge_kutta import Limits
from solver.kernels.state import FaceValues, Fluxes
from solver.referenced import by_reference

# Sides of a cell.
LOW_X, HIGH_X, LOW_Y, HIGH_Y = 0, 1, 2, 3
# Halvings of an interval and steps of Newton's method that leave nothing but round-off.
_HALVINGS, _STEPS = 60, 30


@by_reference
class Inflows(NamedTuple):
    """Faces that flow comes in through, sorted by cell, and the hydrographs of their sections.

    Attributes
    ----------
    first, closed, order
        The faces of the cells of padded row j, or of block j of a cloud, are ``first[j]`` to
        ``first[j + 1]``. Fluxes found with row j are those of the faces ``order[k]``, k from ``closed[j]`` to
        ``closed[j + 1]``.
    cell, column, side, section
        Index of the cell that flow comes into, its column, the side of it, the number of the section. On a
        cloud nothing is said of columns and sides, and ``closed`` and ``order`` are empty.
    sign
        1 where flow comes in toward the high side of the face, the right one on a cloud, else -1.
    along, across
        Components of the direction of flow normal to the face, in the direction of the lattice or from the
        left cell to the right one, and along it.
    own
        Components of the normal of the face in the frame of the cell, shape (2, faces).
    width, length, bottom, slant
        Width across the flow and what fluxes are divided by (m, or 1 where they are multiplied by lengths of
        edges), elevation of the bed, m, and depth normal to the bed per vertical depth.
    edge
        What pressure is multiplied by: length of the edge, m, or 1.
    room
        Area of the cell above the face and of the one below over the length of the face, shape (2, faces), m.
    beta
        g cos(xi) of the cell, m s-2.
    rate
        Rates that a speed along and across the face has, shape (2, faces), m-1.
    falling
        Wave rate that gives the longest step from rest in the cell, s-1.
    mass, depth, speed
        Of the step: flux of mass, of the size of other fluxes, depth (m) and speed (m s-1) of what comes in.
    graphs
        Hydrographs of the sections.
    total, opened, flowing, entered
        Of each section: width, m, whether its cells take part in the step, mean discharge in it, m3 s-1, and
        volume that has come in, m3.
    until
        Time after which nothing comes in, s, shape (1,).
    before
        Fluxes of faces while others stand in their place, shape (4, faces).
    """

    first: Indices
    closed: Indices
    order: Indices
    cell: Indices
    column: Indices
    side: Indices
    section: Indices
    sign: Array
    along: Array
    across: Array
    own: Array
    width: Array
    length: Array
    bottom: Array
    slant: Array
    edge: Array
    room: Array
    beta: Array
    rate: Array
    falling: Array
    mass: Array
    depth: Array
    speed: Array
    graphs: Hydrographs
    total: Array
    opened: Array
    flowing: Array
    entered: Array
    until: Array
    before: Array


@kernel()
def depth_under(inflows: Inflows, e: int, level: float) -> float:
    """Depth normal to the bed at face e under a level surface at an elevation, m."""
    return float(max(0.0, level - inflows.bottom[e]) * inflows.slant[e])


@kernel()
def discharge_under(inflows: Inflows, k: int, level: float) -> float:
    """Discharge of section k by its rating under a level surface at an elevation (m), m3 s-1."""
    total = 0.0
    for e in range(len(inflows.cell)):
        if inflows.section[e] == k:
            total += inflows.width[e] * unit_discharge(inflows.graphs, k, depth_under(inflows, e, level))
    return total


@kernel()
def fill_section(inflows: Inflows, k: int, discharge: float) -> None:
    """Share a discharge (m3 s-1) over the faces of section k under a level surface.

    Where the bed is level all have the depth of the mean discharge per width. Otherwise the level is found by
    halving; the shares are those of the rating, and add up to the discharge exactly.
    """
    width, lowest, highest, slant = inflows.total[k], math.inf, -math.inf, 1.0
    for e in range(len(inflows.cell)):
        if inflows.section[e] == k:
            highest = max(highest, inflows.bottom[e])
            if inflows.bottom[e] < lowest:
                lowest, slant = inflows.bottom[e], inflows.slant[e]
    mean, fixed = depth_of(inflows.graphs, k, discharge / width), inflows.graphs.fixed[k]
    if fixed > 0.0:
        level = lowest + fixed / slant
    elif highest == lowest:
        level = lowest + mean / slant
    else:
        low, high = lowest, highest + 2.0 * mean / slant
        while discharge_under(inflows, k, high) < discharge:
            high += high - lowest
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if discharge_under(inflows, k, middle) < discharge:
                low = middle
            else:
                high = middle
        level = high
    total = discharge_under(inflows, k, level)
    for e in range(len(inflows.cell)):
        if inflows.section[e] == k:
            h = depth_under(inflows, e, level)
            # what the level is above a bed at one elevation is round-off of elevations
            h = (fixed if fixed > 0.0 else mean) if highest == lowest else h
            part = unit_discharge(inflows.graphs, k, h) if highest > lowest else 1.0
            part *= discharge / (total if highest > lowest else width)
            inflows.depth[e] = h
            inflows.speed[e] = part / h if h > 0.0 else 0.0
            inflows.mass[e] = part * inflows.width[e] / inflows.length[e]


@kernel()
def await_inflow(inflows: Inflows, time: float, limits: Limits, rate: float) -> float:
    """Let what comes in before long count in the length of the step, and open the sections that it passes.

    So does gravity where it comes to: a thin film has next to no waves, and falls down a dry slope.

    Parameters
    ----------
    time : float
        At the start of the step, s.
    rate : float
        Largest wave rate of what flows already, s-1.

    Returns
    -------
    float
        Largest wave rate, that of what comes in included, s-1.
    """
    remaining = limits.target - time
    horizon = min(limits.cfl / rate, remaining) if rate > 0.0 else remaining
    for k in range(len(inflows.flowing)):
        start = next_flow(inflows.graphs, k, time)
        if start - time >= horizon:
            continue
        if start - time > 2.0 * limits.shortest:
            # a step ends where the flow begins
            rate = max(rate, limits.cfl / (start - time))
            horizon = min(horizon, start - time)
            continue
        peak = peak_within(inflows.graphs, k, time, time + horizon)
        if peak <= 0.0:
            continue
        fill_section(inflows, k, peak)
        for e in range(len(inflows.cell)):
            if inflows.section[e] == k and inflows.mass[e] > 0.0:
                wave, u = math.sqrt(inflows.beta[e] * inflows.depth[e]), inflows.speed[e]
                along, across = abs(inflows.along[e]) * u, abs(inflows.across[e]) * u
                this = (along + wave) * inflows.rate[0, e] + (across + wave) * inflows.rate[1, e]
                rate = max(rate, this, inflows.falling[e])
    for k in range(len(inflows.flowing)):
        soon = next_flow(inflows.graphs, k, time) - time <= 2.0 * limits.shortest
        inflows.opened[k] = 1.0 if soon else 0.0
    return rate


@kernel()
def open_rows(inflows: Inflows, static: Array, wet: Indices, moving: Indices) -> None:
    """Let the cells of a lattice that flow comes into take part in a step.

    Parameters
    ----------
    static : flat array
        Status of the cells, set to 0 where flow comes in.
    wet, moving : (2, rows) arrays
        Spans of padded rows, which are made to hold these cells.
    """
    for j in range(len(inflows.first) - 1):
        for e in range(inflows.first[j], inflows.first[j + 1]):
            if inflows.opened[inflows.section[e]] > 0.0:
                c, static[inflows.cell[e]] = inflows.column[e], 0.0
                for spans in (wet, moving):
                    if spans[0, j] < spans[1, j]:
                        spans[0, j], spans[1, j] = min(spans[0, j], c), max(spans[1, j], c + 1)
                    else:
                        spans[0, j], spans[1, j] = c, c + 1


@kernel()
def begin_inflow(inflows: Inflows, time: float, dt: float) -> None:
    """Find what comes in during a step from a time on (s), and count its volume.

    It is what the hydrograph has let in by the end of the step less what has come in before.
    """
    for k in range(len(inflows.flowing)):
        inflows.flowing[k] = 0.0
        volume = volume_until(inflows.graphs, k, time + dt) - inflows.entered[k]
        opened = inflows.opened[k] > 0.0 and time < inflows.until[0]
        if opened and volume > 0.0 and dt > 0.0:
            inflows.flowing[k] = volume / dt
            fill_section(inflows, k, volume / dt)
            inflows.entered[k] += volume


@kernel()
def close_to_backflow(
    inflows: Inflows,
    h: Array,
    row: int,
    stride: int,
    along: FaceValues,
    across: FaceValues,
    room: int,
    x_fluxes: Fluxes,
    y_fluxes: Fluxes,
    ring: int,
    dt: float,
) -> None:
    """Let nothing out against the flow through the faces whose fluxes were found with a row.

    What lies above such a face meets a wall: it feels its own pressure there, and what moves to it is
    stopped. Without that a film above a deep section would fall for ever without going anywhere.

    Parameters
    ----------
    h : flat array
        Depth, m.
    row, stride : int
        Padded row, and distance in memory to the next one.
    along, across, room
        Values at the faces of the row along x, and of it and the next one along y, even rows first, each in
        a length of ``room``.
    ring : int
        Index of column 0 of the row in the fluxes.
    dt : float
        Time step, s.
    """
    for n in range(inflows.closed[row], inflows.closed[row + 1]):
        e = inflows.order[n]
        if inflows.flowing[inflows.section[e]] <= 0.0:
            continue
        along_x, sign = inflows.side[e] <= HIGH_X, inflows.sign[e]
        at = ring + inflows.column[e] + (1 if inflows.side[e] == HIGH_X else 0)
        fluxes = x_fluxes if along_x else y_fluxes
        if sign * fluxes.mass[at] > 0.0:
            continue
        i = inflows.cell[e] - (1 if along_x else stride) * int(sign)
        values = along if along_x else across
        k = inflows.column[e] - int(sign) if along_x else inflows.column[e]
        k += 0 if along_x else ((row if sign > 0.0 else row + 1) % 2) * room
        deep, fast = (
            (values.h_high[k], values.n_high[k]) if sign > 0.0 else (values.h_low[k], values.n_low[k])
        )
        fluxes.mass[at] = fluxes.tangential[at] = 0.0
        push = held_up(deep, sign * fast, values.c[k], h[i], inflows.room[0, e], dt)
        fluxes.normal[at] = push * inflows.edge[e]
        fluxes.pressure[at] = 0.5 * h[i] * h[i] * inflows.edge[e]


@kernel(inline=True)
def held_up(deep: float, toward: float, c: float, h: float, room: float, dt: float) -> float:
    """Flux of momentum that a face takes which is closed to backflow, without pressure, m3 s-2.

    That of a wall, `solver.kernels.boundary.wall_flux`, at most what stops the cell.

    Parameters
    ----------
    deep, toward, c : float
        Depth (m), velocity toward the face and wave speed (m s-1) there.
    h, room : float
        Depth of the cell, m, and its area over the length of the face, m.
    dt : float
        Time step, s.
    """
    push, _ = wall_flux(deep, toward, c)
    return float(stopped(push, h * toward, room, dt))


@kernel()
def inflow_depth(mass: float, inside: float, h: float, beta: float) -> float:
    """Depth, m, of flow that comes in slower than its waves, by the invariant ``u - 2 c`` from inside.

    It is that of ``mass / d - 2 sqrt(beta d) = inside - 2 sqrt(beta h)``, at least the critical depth, and
    presses at most as the HLL flux of what meets in the cell does: a thin cell that deep flow runs into from
    below would be thrown off.

    Parameters
    ----------
    mass : float
        Discharge per width normal to the face, m2 s-1.
    inside, h : float
        Velocity inward (m s-1) and depth (m) of the cell.
    beta : float
        g cos(xi) K, m s-2.
    """
    out = inside - 2.0 * math.sqrt(beta * h)
    critical = (mass * beta) ** (1.0 / 3.0)
    # f(c) = 2 c^3 + out c^2 - mass beta is convex and positive here, so that Newton's method descends
    c = max(-0.5 * out, 0.0) + (0.5 * mass * beta) ** (1.0 / 3.0)
    for _ in range(_STEPS):
        step = (c * c * (2.0 * c + out) - mass * beta) / (2.0 * c * (3.0 * c + out))
        c -= step
        if abs(step) <= 1e-15 * c:
            break
    met = max(0.0, critical - inside)
    most = h * (h + 2.0 * met * (met + math.sqrt(beta * h)) / beta)
    return float(max(critical * critical / beta, min(c * c / beta, math.sqrt(most))))


@kernel()
def state_in_door(
    depth: float, speed: float, along: float, inside: float, h: float, beta: float
) -> tuple[float, float]:
    """Depth (m) and speed (m s-1) of flow in a face: as given, or by the cell.

    Flow that is slower than its waves has the depth that the cell gives it. So has faster flow that is
    drowned: where the flow behind a jump has more momentum and pressure, ``q^2 / d + beta d^2 / 2``, the jump
    goes upstream. A thin jet does not hold up a deep layer, which would fall toward the face for ever.

    Parameters
    ----------
    depth, speed : float
        As the section gives them.
    along : float
        Component of its direction normal to the face.
    inside, h, beta : float
        As in `inflow_depth`.
    """
    q = speed * depth
    met = inflow_depth(q * along, inside, h, beta)
    if speed * speed < beta * depth or thrust(q * along, met, beta) > thrust(q * along, depth, beta):
        return met, q / met
    return depth, speed


@kernel(inline=True)
def thrust(q: float, d: float, beta: float) -> float:
    """Momentum and pressure of a discharge q per width (m2 s-1) at a depth d (m), m3 s-2."""
    return q * q / d + 0.5 * beta * d * d


def no_inflows() -> Inflows:
    """Give what kernels are given where nothing comes in."""
    whole, real, both = np.zeros(0, np.int64), np.zeros(0), np.zeros((2, 0))
    return Inflows(
        *(whole,) * 7,
        *(real,) * 3,
        both,
        *(real,) * 5,
        both,
        real,
        both,
        *(real,) * 4,
        no_hydrographs(),
        *(real,) * 4,
        np.full(1, -np.inf),
        np.zeros((4, 0)),
    )
