"""The parts of a time step on a lattice, and the record of maxima."""

from __future__ import annotations

import math

from solver.arrays import Indices
from solver.compiled import kernel
from solver.kernels.boundary import drive_layers
from solver.kernels.erosion import entrain, erode_cell
from solver.kernels.record import Record, record_run
from solver.kernels.runge_kutta import (
    AT_REST,
    CONTINUE,
    GROW,
    NOT_FINITE,
    SSP_RK3,
    Limits,
    Progress,
    march,
    share_of_step,
)
from solver.kernels.sections.inflow import await_inflow, begin_inflow, open_rows
from solver.kernels.sections.measured import sample
from solver.kernels.state import GHOSTS, Fields, Grid
from solver.lattice.arrays import LatticeArrays
from solver.lattice.residual import stage
from solver.lattice.spans import comes_to, copy_surroundings, moving_volume_exceeds, spread
from solver.lattice.status import classify
from solver.lattice.symmetry import images
from solver.lattice.walls import classify_beside

# First and last row to be stepped, and number of cells.
Rows = tuple[int, int, int]


@kernel(fastmath=False, from_python=True)
def record_maxima(
    now: Fields, spans: Indices, grid: Grid, dry: float, threshold: float, record: Record, progress: Progress
) -> bool:
    """Update the maxima within spans; say whether all values are finite, or note the place of one.

    Parameters
    ----------
    spans : (2, ny + 4) array
        Half-open column ranges of each padded row.
    dry, threshold : float
        Depths up to which a cell counts as dry and as not reached, m.
    """
    m, g, time = grid.stride, GHOSTS, progress.time[0]
    for j in range(g, grid.rows - g):
        a, b = spans[0, j], spans[1, j]
        if a < b and not record_run(
            now, j * m + a, b - a, dry, threshold, time, record, (j - g) * (m - 2 * g) + a - g
        ):
            for i in range(a, b):
                flux = now.h[j * m + i] * (now.u[j * m + i] ** 2 + now.v[j * m + i] ** 2)
                if not math.isfinite(flux):
                    progress.place[0], progress.place[1] = j - g, i - g
                    return False
    return True


@kernel(fastmath=False)
def erode(arrays: LatticeArrays, first: int, last: int, dt: float) -> None:
    """Let the cells of some rows erode that are wet and were not static at the start of a step.

    ``dt`` is the length of the step, s.
    """
    now, bed, erosion, spans, m = arrays.now, arrays.bed, arrays.erosion, arrays.spans, arrays.grid.stride
    area = arrays.grid.dx * arrays.grid.dy
    for j in range(first, last + 1):
        gained = 0.0
        for c in range(spans.stepped[0, j], spans.stepped[1, j]):
            i = j * m + c
            if arrays.status.static[i] != 0.0 or now.h[i] <= arrays.material.dry:
                continue
            h, u, v, more = erode_cell(
                erosion,
                i,
                (now.h[i], now.u[i], now.v[i]),
                (bed.along[c], 0.0, bed.normal[c]),
                max(0.0, bed.normal[c] + bed.curvature[c] * (now.u[i] * now.u[i])),
                dt,
                arrays.material,
            )
            now.h[i], now.u[i], now.v[i] = h, u, v
            gained += more
        entrain(images(arrays.sides, j) * gained * area, erosion.entrained)


@kernel(as_source=True, cached=False)
def begin_step(arrays: LatticeArrays, limits: Limits, progress: Progress) -> tuple[int, float, Rows]:
    """Find what is to be stepped, whether anything moves, and the largest wave rate, s-1."""
    now, status, sides, grid, spans = arrays.now, arrays.status, arrays.sides, arrays.grid, arrays.spans
    drive_layers(sides, progress.time[0])
    rate = classify(now, status, arrays.bed, arrays.material, sides, grid, spans)
    beside = classify_beside(now, status, arrays.bed, arrays.material, grid, arrays.walls, spans)
    rate = max(rate, beside)
    waits = progress.time[0] < arrays.inflows.until[0]
    if waits:
        rate = await_inflow(arrays.inflows, progress.time[0], limits, rate)
        open_rows(arrays.inflows, status.static, spans.wet, spans.moving)
    rows = spread(spans, status.static, sides, grid)
    first, last, started = rows[0], rows[1], progress.steps[0] > 0
    outcome = CONTINUE
    if not waits and (
        first > last
        or not moving_volume_exceeds(now, status.static, spans, sides, grid, limits.rest_volume, started)
    ):
        outcome = AT_REST
    elif comes_to(spans.stepped, grid, arrays.inner, first, last):
        outcome = GROW
    return outcome, rate, rows


@kernel(as_source=True, cached=False)
def take_step(arrays: LatticeArrays, rows: Rows, dt: float, progress: Progress) -> None:
    """Take the stages of a step; what is eroded comes after the last."""
    now, one, two = arrays.now, arrays.first_stage, arrays.second_stage
    first, last, cells = rows
    drive_layers(arrays.sides, progress.time[0] + dt)
    if len(arrays.inflows.cell) > 0:
        begin_inflow(arrays.inflows, progress.time[0], dt)
    copy_surroundings(now, one, arrays.spans.stepped, arrays.grid, first, last)
    copy_surroundings(now, two, arrays.spans.stepped, arrays.grid, first, last)
    for k in range(len(SSP_RK3)):
        source = now if k == 0 else (one if k % 2 == 1 else two)
        out = now if k == len(SSP_RK3) - 1 else (one if k % 2 == 0 else two)
        weights = SSP_RK3[k], share_of_step(SSP_RK3, k)
        stage(arrays, now, source, out, first, last, *weights, dt, progress.ledger)
        progress.cell_stages[0] += cells
    if arrays.erosion.available.size > 0:
        erode(arrays, first, last, dt)


@kernel(as_source=True, cached=False)
def end_step(arrays: LatticeArrays, limits: Limits, progress: Progress) -> int:
    """Record the maxima and what passed sections, and look for values that are not finite."""
    if len(arrays.sections.volume) > 0:
        sample(arrays.sections, progress.time[0])
    finite = record_maxima(
        arrays.now,
        arrays.spans.stepped,
        arrays.grid,
        arrays.material.dry,
        limits.arrival_depth,
        arrays.record,
        progress,
    )
    return CONTINUE if finite else NOT_FINITE


@kernel(from_python=True)
def advance_among_buildings(arrays: LatticeArrays, limits: Limits, progress: Progress) -> int:
    """Step until a limit, where the arrays have walls; return which."""
    return int(march(arrays, begin_step, take_step, end_step, limits, progress))


@kernel(from_python=True)
def advance(arrays: LatticeArrays, limits: Limits, progress: Progress) -> int:
    """Step until a limit; return which."""
    return int(march(arrays, begin_step, take_step, end_step, limits, progress))
