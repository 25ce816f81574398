"""The weighted-residual (conservative) form of LMLS on a lattice.

Testing eq. 12 with the indicator function of a point's control volume gives

    V dU/dt = - sum over faces of (length F*) + V S,

with F* the HLL flux between the LMLS reconstructions on both sides of a face. Arrays are flat, row after row
along x, padded by two ghost cells on every side; indices in inner loops are unsigned, since a negative one
would have to wrap around and loops would not vectorise. Only cells whose state can change in a step are
visited: a span of each row, found at the start of the step in `solver.lattice.spans`.
"""

from __future__ import annotations

import math

import numpy as np

from solver.arrays import Array
from solver.compiled import ONE, kernel
from solver.kernels.boundary import account, boundary_flux, stopped
from solver.kernels.flow_axes import sheared
from solver.kernels.friction import law_at
from solver.kernels.riemann import hll
from solver.kernels.runge_kutta import can_give, weight_of_start
from solver.kernels.sections.admission import admit_next
from solver.kernels.sections.inflow import close_to_backflow
from solver.kernels.sections.measured import measure
from solver.kernels.source_terms import acting_share, update_cell
from solver.kernels.state import (
    AXIS,
    BELOW_YIELD,
    EVEN,
    GHOSTS,
    LANES,
    MIDLINE,
    NO_SLIP,
    STILL,
    WALL,
    Bed,
    Fields,
    Fluxes,
    Grid,
    Material,
    Status,
    whole,
)
from solver.lattice.arrays import RING, LatticeArrays
from solver.lattice.ghosts import fill_ghosts
from solver.lattice.outflow import limit_outflow, note_emptied, outflow_exceeds
from solver.lattice.reconstruction import face_values
from solver.lattice.spans import hull
from solver.lattice.symmetry import images, mirror_fluxes
from solver.lattice.walls import close_x, close_y, faces_beside


@kernel()
def restrict_side(
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
    """Impose on a run of boundary faces what their side allows, as `solver.kernels.boundary.boundary_flux`.

    Parameters
    ----------
    fluxes, at
        Fluxes, changed in place, and the index of the first boundary face.
    h, n, t, beta : flat arrays
        Depth (m), normal and tangential velocity (m s-1), g cos(xi) K (m s-2).
    cell, count : int
        Index of the first cell inside, number of faces.
    kind, outward
        Kind of the side, and sign of the outward direction along the face normal.
    """
    for k in range(count):
        f, i = at + k, cell + k
        flux = fluxes.mass[f], fluxes.normal[f], fluxes.tangential[f]
        fluxes.mass[f], fluxes.normal[f], fluxes.tangential[f] = boundary_flux(
            flux, kind, outward, h[i], n[i], t[i], math.sqrt(beta[i] * h[i])
        )


@kernel()
def stage(
    arrays: LatticeArrays,
    start: Fields,
    now: Fields,
    out: Fields,
    first: int,
    last: int,
    part: float,
    share: float,
    dt: float,
    ledger: Array,
) -> None:
    """One Runge-Kutta stage over the spans to be stepped.

    Parameters
    ----------
    start, now, out : Fields
        State at the start of the step, of this stage, and to be filled; ``out`` may be ``start``.
    first, last : int
        Rows to be stepped, from `solver.lattice.spans.spread`.
    part : float
        Weight of this stage's result in the convex combination with ``start``.
    share : float
        Weight of this stage's fluxes in the whole step, for the ledger.
    dt : float
        Time step, s.
    ledger : (2, 4, 2) array
        Volumes that came in and left through x_min, x_max, y_min, y_max, m3.
    """
    status, material, sides, grid = arrays.status, arrays.material, arrays.sides, arrays.grid
    spans, walls, m, dry = arrays.spans.stepped, arrays.walls, grid.stride, material.dry
    inflows, sections = arrays.inflows, arrays.sections
    comes_in, measured = len(inflows.cell) > 0, len(sections.volume) > 0
    # rows of buffers have room for a whole vector more, so that none runs into the next
    room = m + LANES
    along, across, x_fluxes, y_fluxes, lost, emptied, before = arrays.buffers
    h, u, v = now
    beta_x, beta_y, static = status.beta_x, status.beta_y, status.static
    x_mass, y_mass, start_weight = x_fluxes.mass, y_fluxes.mass, weight_of_start(part)
    west, east, low, high = sides.kind[0], sides.kind[1], sides.kind[2], sides.kind[3]
    fill_ghosts(now, beta_x, beta_y, sides, grid, spans, first, last)
    for j in range(first - 1, last + 2):
        ring, below = (j % RING) * room, ((j - 1) % RING) * room
        # nothing passes between the rows of a flow that does not vary: their fluxes stay zero
        if low != EVEN:
            for k in range(j if j < first else j + 1, j + 2):
                a, b = hull(spans, k - 1, k + 1)
                face_values(h, v, u, beta_y, k * m + a, m, whole(b - a), dry, across, (k % 2) * room + a)
                faces_beside(now, walls, status, k, m, dry, False, across, (k % 2) * room)
            a, b = hull(spans, j, j + 1)
            hll(
                across,
                (j % 2) * room + a,
                across,
                ((j + 1) % 2) * room + a,
                static,
                j * m + a,
                m,
                whole(b - a),
                dry,
                y_fluxes,
                ring + a,
            )
            if j == GHOSTS - 1:
                restrict_side(y_fluxes, ring + a, h, v, u, beta_y, (j + 1) * m + a, b - a, low, -1.0)
            if j == grid.rows - GHOSTS - 1:
                restrict_side(y_fluxes, ring + a, h, v, u, beta_y, j * m + a, b - a, high, 1.0)
            close_y(walls, j, m, across, 0, room, y_fluxes, ring)
        emptied[ring] = 0
        a, b = spans[0, j], spans[1, j]
        if a < b:
            face_values(h, u, v, beta_x, j * m + a - 1, ONE, whole(b - a + 2), dry, along, a - 1)
            faces_beside(now, walls, status, j, m, dry, True, along, 0)
            hll(
                along,
                a - 1,
                along,
                a,
                static,
                j * m + a - 1,
                ONE,
                whole(b - a + 1),
                dry,
                x_fluxes,
                ring + a,
            )
            if a == GHOSTS:
                restrict_side(x_fluxes, ring + a, h, u, v, beta_x, j * m + a, ONE, west, -1.0)
                i = j * m + a
                rise = -sides.excess[0] * grid.dx / beta_x[i]
                if rise > h[i] and west in (WALL, NO_SLIP):
                    x_fluxes.normal[ring + a] = stopped(x_fluxes.normal[ring + a], h[i] * -u[i], grid.dx, dt)
            if b == m - GHOSTS:
                restrict_side(x_fluxes, ring + b, h, u, v, beta_x, j * m + b - 1, ONE, east, 1.0)
                i = j * m + b - 1
                rise = sides.excess[1] * grid.dx / beta_x[i]
                if rise > h[i] and east in (WALL, NO_SLIP):
                    x_fluxes.normal[ring + b] = stopped(x_fluxes.normal[ring + b], h[i] * u[i], grid.dx, dt)
            close_x(walls, j, m, along, x_fluxes, ring)
        if comes_in:
            close_to_backflow(inflows, h, j, m, along, across, room, x_fluxes, y_fluxes, ring, dt)
        if a < b:
            over = x_mass, ring + a, y_mass, below + a, ring + a, dt, grid, lost, ring + a
            if outflow_exceeds(h, None, j * m + a, b - a, *over):
                note_emptied(h, start.h, start_weight, j * m + a, a, b - a, lost, ring, emptied)
        limits = ring, below, lost, emptied, start, now, start_weight
        limit_outflow(x_fluxes, y_fluxes, *limits, None, None, j * m, m, j < first)
        if a < b:
            if a == GHOSTS:
                account(images(sides, j) * share * dt * grid.dy * -x_mass[ring + a], 0, ledger)
            if b == m - GHOSTS:
                account(images(sides, j) * share * dt * grid.dy * x_mass[ring + b], 1, ledger)
        row = j - 1
        a, b = spans[0, row], spans[1, row]
        if measured and row >= first - 1:
            measure(sections, row, (a, b), hull(spans, row, row + 1), x_fluxes, y_fluxes, below, share * dt)
        if row < first or a >= b:
            continue
        south = ((row - 1) % RING) * room + a
        if row == GHOSTS and low == AXIS:
            mirror_fluxes(y_fluxes, south, below + a, b - a)
        # the last stage takes the place of the start: its loop would not vectorise on a row that it writes
        copy_row(start, row * m + a, b - a, before, a)
        # the whole row, and cells that flow comes into once more
        cell, c, count = row * m + a, a, b - a
        e, stop = (inflows.first[row], inflows.first[row + 1]) if comes_in else (0, 0)
        begin = e
        while True:
            update_span(arrays, now, out, cell, c, count, below + c, south - a + c, part, dt)
            if not comes_in:
                break
            at = x_fluxes, y_fluxes, south - a, below
            begin, e = admit_next(inflows, (begin, e), stop, c, (a, b), *at, now, beta_x, beta_y, dt)
            if begin >= stop:
                break
            cell, c, count = inflows.cell[begin], inflows.column[begin], 1
        if row == GHOSTS and low not in (AXIS, MIDLINE):
            for k in range(south, south + b - a):
                account(share * dt * grid.dx * -y_mass[k], 2, ledger)
        if row == grid.rows - GHOSTS - 1:
            for k in range(below + a, below + b):
                account(images(sides, row) * share * dt * grid.dx * y_mass[k], 3, ledger)


@kernel(unaliased=True)
def copy_row(source: Fields, cell: int, count: int, target: Fields, to: int) -> None:
    """Copy a run of cells."""
    for k in range(count):
        i, o = np.uint64(cell) + np.uint64(k), np.uint64(to) + np.uint64(k)
        target.h[o], target.u[o], target.v[o] = source.h[i], source.u[i], source.v[i]


@kernel()
def update_span(
    arrays: LatticeArrays,
    now: Fields,
    out: Fields,
    cell: int,
    column: int,
    count: int,
    west: int,
    south: int,
    part: float,
    dt: float,
) -> None:
    """Update a run of cells from the row of the start of the step and the fluxes in the rings of buffers.

    A function of its own, for which what it reads is loaded once a row: in the loop of a stage LLVM would
    move it about on the stack.
    """
    status, bed, material, grid = arrays.status, arrays.bed, arrays.material, arrays.grid
    _, _, x_fluxes, y_fluxes, _, _, before = arrays.buffers
    update_row(
        before,
        now,
        out,
        status,
        bed,
        material,
        cell,
        column,
        count,
        x_fluxes,
        west,
        y_fluxes,
        south,
        west,
        part,
        dt,
        grid,
    )


@kernel(unaliased=True, inline=True)
def update_row(
    start: Fields,
    now: Fields,
    out: Fields,
    status: Status,
    bed: Bed,
    material: Material,
    cell: int,
    column: int,
    count: int,
    x_fluxes: Fluxes,
    west: int,
    y_fluxes: Fluxes,
    south: int,
    north: int,
    part: float,
    dt: float,
    grid: Grid,
) -> None:
    """Update a run of cells, as `solver.kernels.source_terms.update_cell` does one.

    Parameters
    ----------
    start : Fields
        U_0 of a row, by column.
    now, out : Fields
        U_1 and the result.
    cell, column, count : int
        Index of the first cell, its column, number of cells.
    x_fluxes, west, y_fluxes, south, north
        Fluxes and the indices of the first cell's faces.
    """
    over_x, over_y, start_weight = 1.0 / grid.dx, 1.0 / grid.dy, weight_of_start(part)
    one = np.uint64(1)
    for k in range(count):
        k_ = np.uint64(k)
        i, c = np.uint64(cell) + k_, np.uint64(column) + k_
        w, s, n = np.uint64(west) + k_, np.uint64(south) + k_, np.uint64(north) + k_
        e = w + one
        h = now.h[i]
        gain = (x_fluxes.mass[w] - x_fluxes.mass[e]) * over_x + (y_fluxes.mass[s] - y_fluxes.mass[n]) * over_y
        gain_u = (x_fluxes.normal[w] - x_fluxes.normal[e]) * over_x
        gain_u += (y_fluxes.tangential[s] - y_fluxes.tangential[n]) * over_y
        gain_v = (x_fluxes.tangential[w] - x_fluxes.tangential[e]) * over_x
        gain_v += (y_fluxes.normal[s] - y_fluxes.normal[n]) * over_y
        free = 0.0 if status.static[i] == BELOW_YIELD else 1.0
        acting = acting_share(h, can_give(h + dt * gain, start.h[c], start_weight))
        load, free = acting * h, acting * free
        push_x = status.beta_x[i] * (x_fluxes.pressure[w] - x_fluxes.pressure[e]) * over_x
        push_y = status.beta_y[i] * (y_fluxes.pressure[s] - y_fluxes.pressure[n]) * over_y
        more_x, more_y = sheared(
            status.beta_xy,
            i,
            (x_fluxes.pressure[w] - x_fluxes.pressure[e]) * over_x,
            (y_fluxes.pressure[s] - y_fluxes.pressure[n]) * over_y,
        )
        push_x, push_y = push_x + more_x, push_y + more_y
        out.h[i], out.u[i], out.v[i] = update_cell(
            (start.h[c], start.u[c], start.v[c]),
            (h, now.u[i], now.v[i]),
            (gain, gain_u, gain_v),
            (free * (push_x + bed.along[c] * h), free * push_y),
            (bed.normal[c], bed.curvature[c]),
            load,
            part,
            dt,
            law_at(material.law, i),
            material.dry,
            STILL * material.dry,
        )
