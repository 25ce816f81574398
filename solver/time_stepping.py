"""SSP Runge-Kutta steps (eq. 14) of adaptive length, and the record of maxima."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.activity import Bed, Material, Status, classify
from solver.boundary import GHOSTS, Fields, Grid, Sides
from solver.compiled import Array, Indices, kernel
from solver.spans import Spans, comes_to, copy_surroundings, moving_volume_exceeds, spread
from solver.weighted_residual import Buffers, stage

# Eq. 14: weights of each stage's result in U = U_0 + part (U_k - U_0 + dt L(U_k)).
SSP_RK3 = (1.0, 1 / 4, 2 / 3)

REACHED, AT_REST, OUT_OF_STEPS, NOT_FINITE, COLLAPSED, GROW, OUT_OF_TIME = range(7)


class Record(NamedTuple):
    """Over all time steps, flat arrays of the lattice without ghosts.

    depth : largest, m. speed_squared : largest |u|^2, m2 s-2. momentum_flux : largest h |u|^2, m3 s-2.
    arrival : first time with depth above the arrival depth, s, NaN before.
    """

    depth: Array
    speed_squared: Array
    momentum_flux: Array
    arrival: Array


class Progress(NamedTuple):
    """What a run has used, arrays of shape (1,) or (2,) changed in place.

    time : s. steps, cell_stages : counts. place : row, column of a failure. ledger : volumes in and out
    of each side, shape (4, 2), m3.
    """

    time: Array
    steps: Indices
    cell_stages: Indices
    ledger: Array
    place: Indices


@kernel(fastmath=False, unaliased=True)
def record_run(
    now: Fields, cell: int, count: int, dry: float, threshold: float, time: float, record: Record, to: int
) -> bool:
    """Update the maxima of a run of cells; say whether all values are finite. A dry cell has no speed."""
    bad = 0
    for k in range(count):
        i, o = np.uint64(cell) + np.uint64(k), np.uint64(to) + np.uint64(k)
        h = now.h[i]
        square = now.u[i] * now.u[i] + now.v[i] * now.v[i]
        flux = h * square
        bad |= 1 if flux - flux != 0.0 else 0
        square = square if h > dry else 0.0
        record.depth[o] = h if h > record.depth[o] else record.depth[o]
        record.speed_squared[o] = square if square > record.speed_squared[o] else record.speed_squared[o]
        record.momentum_flux[o] = flux if flux > record.momentum_flux[o] else record.momentum_flux[o]
        record.arrival[o] = (
            time if (h > threshold) & (record.arrival[o] != record.arrival[o]) else record.arrival[o]
        )
    return bad == 0


@kernel(fastmath=False)
def record_maxima(
    now: Fields, spans: Indices, grid: Grid, dry: float, threshold: float, record: Record, progress: Progress
) -> bool:
    """Update the maxima within the given spans (2, ny + 4); on a value that is not finite, note its place."""
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


@kernel()
def step_length(rate: float, cfl: float, remaining: float, shortest: float) -> float:
    """Length of the next step, s, by the largest wave rate (s-1); 0 where it would be below ``shortest``.

    The last two steps before a target are of equal length, so that no sliver of a step is left.
    """
    dt = cfl / rate if rate > 0.0 else remaining
    if dt < shortest:
        return 0.0
    if dt >= remaining:
        return remaining
    return 0.5 * remaining if 2.0 * dt > remaining else dt


@kernel()
def share_of_step(parts: tuple[float, ...], k: int) -> float:
    """Weight of the k-th stage's fluxes in the whole step."""
    share = 1.0
    for n in range(k, len(parts)):
        share *= parts[n]
    return share


@kernel()
def advance(
    now: Fields,
    first_stage: Fields,
    second_stage: Fields,
    status: Status,
    bed: Bed,
    material: Material,
    sides: Sides,
    grid: Grid,
    spans: Spans,
    inner: NDArray[np.bool_],
    buffers: Buffers,
    parts: tuple[float, ...],
    cfl: float,
    target: float,
    shortest: float,
    max_steps: int,
    rest_volume: float,
    threshold: float,
    record: Record,
    progress: Progress,
) -> int:
    """Step until ``target`` (s) or until at most ``rest_volume`` (m3) moves; return why it stopped.

    inner : (4,) array, whether a side is inside the lattice: what comes to it stops the run before the step.
    shortest : a step below it counts as collapsed, s.
    """
    stages = len(parts)
    while progress.time[0] < target:
        # before anything is touched, so that the run can go on from here as if it had not stopped
        if progress.steps[0] >= max_steps:
            return OUT_OF_STEPS
        rate = classify(now, status, bed, material, sides, grid, spans)
        first, last, cells = spread(spans, status.still, sides, grid)
        started = progress.steps[0] > 0
        if first > last or not moving_volume_exceeds(
            now, status.still, spans, sides, grid, rest_volume, started
        ):
            return AT_REST
        if comes_to(spans.stepped, grid, inner, first, last):
            return GROW
        remaining = target - progress.time[0]
        dt = step_length(rate, cfl, remaining, shortest)
        if dt == 0.0:
            return COLLAPSED
        copy_surroundings(now, first_stage, spans.stepped, grid, first, last)
        copy_surroundings(now, second_stage, spans.stepped, grid, first, last)
        source = now
        for k in range(stages):
            out = now if k == stages - 1 else (first_stage if k % 2 == 0 else second_stage)
            stage(
                now,
                source,
                out,
                status,
                bed,
                material,
                sides,
                grid,
                spans.stepped,
                first,
                last,
                parts[k],
                share_of_step(parts, k),
                dt,
                buffers,
                progress.ledger,
            )
            source = out
        progress.time[0] = target if dt == remaining else progress.time[0] + dt
        progress.steps[0] += 1
        progress.cell_stages[0] += stages * cells
        if not record_maxima(now, spans.stepped, grid, material.dry, threshold, record, progress):
            return NOT_FINITE
    return REACHED
