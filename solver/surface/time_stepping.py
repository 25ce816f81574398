"""The parts of a time step on a surface."""

from __future__ import annotations

from solver.arrays import Array, Indices
from solver.compiled import kernel
from solver.kernels.boundary import account
from solver.kernels.erosion import entrain, erode_cell
from solver.kernels.runge_kutta import (
    AT_REST,
    CONTINUE,
    GROW,
    NOT_FINITE,
    SSP_RK3,
    Limits,
    Progress,
    march,
)
from solver.kernels.sections.inflow import await_inflow, begin_inflow, open_rows
from solver.kernels.sections.measured import sample
from solver.kernels.state import GHOSTS, Fields, Grid
from solver.lattice.spans import comes_to, copy_surroundings, spread
from solver.lattice.time_stepping import Rows, record_maxima
from solver.surface.arrays import SurfaceArrays
from solver.surface.metric import Metric
from solver.surface.residual import take_stages
from solver.surface.status import classify_surface, moving_volume_exceeds
from solver.surface.walls import classify_edges_beside


@kernel(from_python=True)
def empty_drains(now: Fields, metric: Metric, spans: Indices, grid: Grid, ledger: Array) -> None:
    """Take what has come to cells where nothing is known of the surface into the ledger, m3."""
    m = grid.stride
    for j in range(GHOSTS, grid.rows - GHOSTS):
        for i in range(j * m + spans[0, j], j * m + spans[1, j]):
            side = metric.drain[i]
            if side > 0 and now.h[i] > 0.0:
                account(now.h[i] / metric.per_area[i], side - 1, ledger)
                now.h[i] = now.u[i] = now.v[i] = 0.0


@kernel(fastmath=False)
def erode(arrays: SurfaceArrays, first: int, last: int, dt: float) -> None:
    """Let the cells of some rows that were not static at the start of a step erode, over its length, s."""
    now, metric, erosion, spans, m = (
        arrays.now,
        arrays.metric,
        arrays.erosion,
        arrays.spans,
        arrays.grid.stride,
    )
    for j in range(first, last + 1):
        for i in range(j * m + spans.stepped[0, j], j * m + spans.stepped[1, j]):
            if arrays.static[i] != 0.0 or now.h[i] <= arrays.material.dry:
                continue
            u, v = now.u[i], now.v[i]
            bend = metric.k_11[i] * (u * u) + metric.k_22[i] * (v * v) + 2.0 * metric.k_12[i] * (u * v)
            h, u, v, more = erode_cell(
                erosion,
                i,
                (now.h[i], u, v),
                (metric.g_1[i], metric.g_2[i], metric.g_n[i]),
                max(0.0, metric.g_n[i] + bend),
                dt,
                arrays.material,
            )
            now.h[i], now.u[i], now.v[i] = h, u, v
            entrain(more / metric.per_area[i], erosion.entrained)


@kernel()
def begin_step(arrays: SurfaceArrays, limits: Limits, progress: Progress) -> tuple[int, float, Rows]:
    """Find what is to be stepped, whether anything moves, and the largest wave rate, s-1."""
    now, static, grid, spans = arrays.now, arrays.static, arrays.grid, arrays.spans
    pressure = arrays.pressure
    rate = classify_surface(now, static, pressure, arrays.metric, arrays.material, grid, spans)
    about = arrays.metric, arrays.material, grid, arrays.walls
    rate = max(rate, classify_edges_beside(now, static, pressure, *about, spans))
    waits = progress.time[0] < arrays.inflows.until[0]
    if waits:
        rate = await_inflow(arrays.inflows, progress.time[0], limits, rate)
        open_rows(arrays.inflows, static, spans.wet, spans.moving)
    rows = spread(spans, static, arrays.sides, grid)
    first, last, started = rows[0], rows[1], progress.steps[0] > 0
    outcome = CONTINUE
    if not waits and (
        first > last
        or not moving_volume_exceeds(now, static, spans, arrays.metric, grid, limits.rest_volume, started)
    ):
        outcome = AT_REST
    elif comes_to(spans.stepped, grid, arrays.inner, first, last):
        outcome = GROW
    return outcome, rate, rows


@kernel()
def take_step(arrays: SurfaceArrays, rows: Rows, dt: float, progress: Progress) -> None:
    """Take the stages of a step; what is eroded comes after them."""
    first, last, cells = rows
    if len(arrays.inflows.cell) > 0:
        begin_inflow(arrays.inflows, progress.time[0], dt)
    for state in (arrays.first_stage, arrays.second_stage):
        copy_surroundings(arrays.now, state, arrays.spans.stepped, arrays.grid, first, last)
    take_stages(arrays, first, last, dt)
    if arrays.erosion.available.size > 0:
        erode(arrays, first, last, dt)
    progress.cell_stages[0] += len(SSP_RK3) * cells


@kernel()
def end_step(arrays: SurfaceArrays, limits: Limits, progress: Progress) -> int:
    """Record the maxima and what passed sections, look for values not finite, and empty the drains."""
    if len(arrays.sections.volume) > 0:
        sample(arrays.sections, progress.time[0])
    now, spans, grid = arrays.now, arrays.spans.stepped, arrays.grid
    dry, record = arrays.material.dry, arrays.record
    finite = record_maxima(now, spans, grid, dry, limits.arrival_depth, record, progress)
    empty_drains(now, arrays.metric, spans, grid, progress.ledger)
    return CONTINUE if finite else NOT_FINITE


@kernel(from_python=True)
def advance_among_buildings(arrays: SurfaceArrays, limits: Limits, progress: Progress) -> int:
    """Step until a limit, where the arrays have walls; return which."""
    return int(march(arrays, begin_step, take_step, end_step, limits, progress))


@kernel(from_python=True)
def advance_surface(arrays: SurfaceArrays, limits: Limits, progress: Progress) -> int:
    """Step until a limit; return which."""
    return int(march(arrays, begin_step, take_step, end_step, limits, progress))
