"""SSP Runge-Kutta steps (eq. 14) of adaptive length, and the record of maxima."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Indices
from solver.compiled import kernel
from solver.kernels.record import Record, record_run
from solver.kernels.runge_kutta import (
    AT_REST,
    COLLAPSED,
    GROW,
    NOT_FINITE,
    OUT_OF_STEPS,
    REACHED,
    Progress,
    share_of_step,
    step_length,
)
from solver.kernels.state import GHOSTS, Bed, Fields, Grid, Material, Sides, Status
from solver.lattice.residual import Buffers, stage
from solver.lattice.spans import Spans, comes_to, copy_surroundings, moving_volume_exceeds, spread
from solver.lattice.status import classify


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
        first, last, cells = spread(spans, status.static, sides, grid)
        started = progress.steps[0] > 0
        if first > last or not moving_volume_exceeds(
            now, status.static, spans, sides, grid, rest_volume, started
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
