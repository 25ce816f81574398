"""The weighted-residual form on a surface: one Runge-Kutta stage on cells lifted on to the bed.

The scheme of `solver.lattice.residual` with fluxes times the lengths of edges, and momentum turned into the
frame of each cell:

    A dh/dt = - sum over edges of +-M,
    A d(hu)/dt = - sum over edges of +-R (F_n, F_t) +- g_n P nu + A (g_1, g_2) h.
"""

from __future__ import annotations

import numpy as np

from solver.arrays import Array
from solver.compiled import ONE, kernel
from solver.kernels.friction import law_at
from solver.kernels.riemann import hll
from solver.kernels.runge_kutta import SSP_RK3, can_give, share_of_step, weight_of_start
from solver.kernels.sections.admission import admit_next
from solver.kernels.sections.inflow import close_to_backflow
from solver.kernels.sections.measured import measure
from solver.kernels.source_terms import acting_share, update_cell
from solver.kernels.state import BELOW_YIELD, LANES, STILL, Fields, Fluxes, Material, whole
from solver.lattice.arrays import RING
from solver.lattice.outflow import limit_outflow, note_emptied, outflow_exceeds
from solver.lattice.residual import copy_row
from solver.lattice.spans import hull
from solver.lattice.walls import close_x, close_y
from solver.surface.arrays import SurfaceArrays
from solver.surface.metric import Metric
from solver.surface.pressure import Pressure, over_edges, pushed, tilts_of
from solver.surface.reconstruction import edge_values
from solver.surface.walls import edges_beside

# Rows that a stage is behind the one before: it reads two rows ahead, and a row is updated with the next.
BEHIND = 3


@kernel(unaliased=True)
def lengthen(fluxes: Fluxes, at: int, length: Array, cell: int, count: int) -> None:
    """Multiply fluxes by the lengths of their edges, m; the first edge is that of a cell on its low side."""
    for k in range(count):
        f, edge = np.uint64(at) + np.uint64(k), length[np.uint64(cell) + np.uint64(k)]
        fluxes.mass[f] *= edge
        fluxes.normal[f] *= edge
        fluxes.tangential[f] *= edge
        fluxes.pressure[f] *= edge


@kernel(unaliased=True)
def update_row(
    start: Fields,
    begin: int,
    now: Fields,
    out: Fields,
    static: Array,
    pressure: Pressure | None,
    metric: Metric,
    material: Material,
    cell: int,
    stride: int,
    count: int,
    x_fluxes: Fluxes,
    west: int,
    y_fluxes: Fluxes,
    south: int,
    north: int,
    part: float,
    dt: float,
) -> None:
    """Update a run of cells, as `update_cell` does one; ``begin`` is the first cell in ``start``."""
    _, x_cl, x_sl, x_ch, x_sh = metric.x_edges
    _, y_cl, y_sl, y_ch, y_sh = metric.y_edges
    x_mass, x_normal, x_tangential, x_pressure = x_fluxes
    y_mass, y_normal, y_tangential, y_pressure = y_fluxes
    one, row, start_weight = np.uint64(1), np.uint64(stride), weight_of_start(part)
    for k in range(count):
        k_ = np.uint64(k)
        i, b = np.uint64(cell) + k_, np.uint64(begin) + k_
        f_w, f_e = np.uint64(west) + k_, np.uint64(west + 1) + k_
        f_s, f_n = np.uint64(south) + k_, np.uint64(north) + k_
        w, s = i - one, i - row
        per_area, g_n = metric.per_area[i], metric.g_n[i]
        h_1, u_1, v_1 = now.h[i], now.u[i], now.v[i]
        gain = ((x_mass[f_w] - x_mass[f_e]) + (y_mass[f_s] - y_mass[f_n])) * per_area
        acting = acting_share(h_1, can_give(h_1 + dt * gain, start.h[b], start_weight))
        load, free = acting * h_1, 0.0 if static[i] == BELOW_YIELD else 1.0
        push = acting * (free * g_n)
        n_w, n_e, n_s, n_n = x_normal[f_w], x_normal[f_e], y_normal[f_s], y_normal[f_n]
        pressed_u = pressed_v = 0.0
        if pressure is None:
            n_w, n_e = n_w + push * x_pressure[f_w], n_e + push * x_pressure[f_e]
            n_s, n_n = n_s + push * y_pressure[f_s], n_n + push * y_pressure[f_n]
        else:
            p_w, p_e, p_s, p_n = x_pressure[f_w], x_pressure[f_e], y_pressure[f_s], y_pressure[f_n]
            pressed_u, pressed_v = pushed(
                pressure,
                i,
                g_n,
                (x_ch[w] * p_w - x_cl[i] * p_e) + (y_ch[s] * p_s - y_cl[i] * p_n),
                (x_sh[w] * p_w - x_sl[i] * p_e) + (y_sh[s] * p_s - y_sl[i] * p_n),
            )
            pressed_u, pressed_v = (acting * free) * pressed_u, (acting * free) * pressed_v
        t_w, t_e, t_s, t_n = x_tangential[f_w], x_tangential[f_e], y_tangential[f_s], y_tangential[f_n]
        gain_u = ((x_ch[w] * n_w - x_sh[w] * t_w) - (x_cl[i] * n_e - x_sl[i] * t_e)) + (
            (y_ch[s] * n_s - y_sh[s] * t_s) - (y_cl[i] * n_n - y_sl[i] * t_n)
        )
        gain_u += pressed_u
        gain_v = ((x_sh[w] * n_w + x_ch[w] * t_w) - (x_sl[i] * n_e + x_cl[i] * t_e)) + (
            (y_sh[s] * n_s + y_ch[s] * t_s) - (y_sl[i] * n_n + y_cl[i] * t_n)
        )
        gain_v += pressed_v
        bend = (
            metric.k_11[i] * (u_1 * u_1) + metric.k_22[i] * (v_1 * v_1) + 2.0 * metric.k_12[i] * (u_1 * v_1)
        )
        out.h[i], out.u[i], out.v[i] = update_cell(
            (start.h[b], start.u[b], start.v[b]),
            (h_1, u_1, v_1),
            (gain, gain_u * per_area, gain_v * per_area),
            ((free * metric.g_1[i]) * load, (free * metric.g_2[i]) * load),
            (g_n + bend, 0.0),
            load,
            part,
            dt,
            law_at(material.law, i),
            material.dry,
            STILL * material.dry,
        )


@kernel(inline=True)
def sweep_row(
    arrays: SurfaceArrays,
    start: Fields,
    now: Fields,
    out: Fields,
    j: int,
    first: int,
    place: int,
    part: float,
    share: float,
    dt: float,
) -> None:
    """Find the fluxes of a row in a Runge-Kutta stage, and update the row before, whose fluxes are all known.

    Parameters
    ----------
    start, now, out : Fields
        State at the start of the step, of this stage, and to be filled; ``out`` may be ``start``.
    j : int
        The row; rows are swept from the one before ``first`` to the one after the last that is stepped.
    first : int
        First row to be stepped, from `solver.lattice.spans.spread`.
    place : int
        Number of the stage among those that are swept together, each of which has buffers of its own.
    part : float
        Weight of this stage's result in the convex combination with ``start``.
    share : float
        Weight of this stage's fluxes in the whole step, for what passes sections.
    dt : float
        Time step, s.
    """
    static, metric, material, grid = arrays.static, arrays.metric, arrays.material, arrays.grid
    pressure = arrays.pressure
    beta_x, beta_y = over_edges(pressure, metric.g_n)
    tilt_x, tilt_y = tilts_of(pressure, metric)
    spans, walls, m, dry = arrays.spans.stepped, arrays.walls, grid.stride, material.dry
    inflows, sections = arrays.inflows, arrays.sections
    comes_in, measured = len(inflows.cell) > 0, len(sections.volume) > 0
    room = m + LANES
    levels, (along, across, x_fluxes, y_fluxes, lost, emptied, before) = arrays.levels, arrays.buffers
    h, u, v = now
    x, y = metric.x_edges, metric.y_edges
    x_mass, y_mass, start_weight = x_fluxes.mass, y_fluxes.mass, weight_of_start(part)
    rows, even = place * RING * room, place * 2 * room
    ring, below = rows + (j % RING) * room, rows + ((j - 1) % RING) * room
    for k in range(j if j < first else j + 1, j + 2):
        a, b = hull(spans, k - 1, k + 1)
        into = even + (k % 2) * room
        edge_values(h, u, v, beta_y, tilt_y, y, k * m + a, m, whole(b - a), dry, levels, across, into + a)
        edges_beside(now, walls, beta_y, tilt_y, y, k, m, m, dry, levels, across, into)
    a, b = hull(spans, j, j + 1)
    one, two = even + (j % 2) * room + a, even + ((j + 1) % 2) * room + a
    hll(across, one, across, two, static, j * m + a, m, whole(b - a), dry, y_fluxes, ring + a)
    close_y(walls, j, m, across, even, room, y_fluxes, ring)
    lengthen(y_fluxes, ring + a, y.length, j * m + a, b - a)
    emptied[ring] = 0
    a, b = spans[0, j], spans[1, j]
    if a < b:
        cell = j * m + a - 1
        edge_values(h, u, v, beta_x, tilt_x, x, cell, ONE, whole(b - a + 2), dry, levels, along, a - 1)
        edges_beside(now, walls, beta_x, tilt_x, x, j, m, ONE, dry, levels, along, 0)
        hll(along, a - 1, along, a, static, cell, ONE, whole(b - a + 1), dry, x_fluxes, ring + a)
        close_x(walls, j, m, along, x_fluxes, ring)
        lengthen(x_fluxes, ring + a, x.length, cell, b - a + 1)
    if comes_in:
        close_to_backflow(inflows, h, j, m, along, across, room, x_fluxes, y_fluxes, ring, dt)
    if a < b:
        cell = j * m + a - 1
        over = x_mass, ring + a, y_mass, below + a, ring + a, dt, grid, lost, ring + a
        if outflow_exceeds(h, metric.per_area, cell + 1, b - a, *over):
            note_emptied(h, start.h, start_weight, cell + 1, a, b - a, lost, ring, emptied)
    limits = ring, below, lost, emptied, start, now, start_weight
    limit_outflow(x_fluxes, y_fluxes, *limits, x, y, j * m, m, j < first)
    row = j - 1
    a, b = spans[0, row], spans[1, row]
    if measured and row >= first - 1:
        across_y = hull(spans, row, row + 1)
        measure(sections, row, (a, b), across_y, x_fluxes, y_fluxes, below, share * dt)
    if row < first or a >= b:
        return
    south = rows + ((row - 1) % RING) * room + a
    cell, count = row * m + a, b - a
    copy_row(start, cell, count, before, a)
    # the whole row, and cells that flow comes into once more; one call, which is compiled into this loop
    c = a
    e, stop = (inflows.first[row], inflows.first[row + 1]) if comes_in else (0, 0)
    begin = e
    while True:
        update_row(
            before,
            c,
            now,
            out,
            static,
            pressure,
            metric,
            material,
            cell,
            m,
            count,
            x_fluxes,
            below + c,
            y_fluxes,
            south - a + c,
            below + c,
            part,
            dt,
        )
        if not comes_in:
            break
        at = x_fluxes, y_fluxes, south - a, below
        begin, e = admit_next(inflows, (begin, e), stop, c, (a, b), *at, now, beta_x, beta_y, dt)
        if begin >= stop:
            break
        cell, c, count = inflows.cell[begin], inflows.column[begin], 1


@kernel()
def take_stages(arrays: SurfaceArrays, first: int, last: int, dt: float) -> None:
    """Take the stages of a step over the spans to be stepped, in one sweep over the rows.

    Each stage follows the one before as close as it may: what it reads has then not yet left the caches.
    Where something comes in or passes sections one follows the other, since their sums are over stages.

    Parameters
    ----------
    first, last : int
        Rows to be stepped, from `solver.lattice.spans.spread`.
    dt : float
        Time step, s.
    """
    now, one, two = arrays.now, arrays.first_stage, arrays.second_stage
    apart = len(arrays.inflows.cell) > 0 or len(arrays.sections.volume) > 0
    lag = last - first + BEHIND if apart else BEHIND
    for sweep in range(first - 1, last + 2 + (len(SSP_RK3) - 1) * lag):
        # one call, which is compiled into this loop
        for k in range(len(SSP_RK3)):
            j = sweep - k * lag
            if not first - 1 <= j <= last + 1:
                continue
            source = now if k == 0 else (one if k % 2 == 1 else two)
            out = now if k == len(SSP_RK3) - 1 else (one if k % 2 == 0 else two)
            weights = SSP_RK3[k], share_of_step(SSP_RK3, k)
            sweep_row(arrays, now, source, out, j, first, 0 if apart else k, *weights, dt)
