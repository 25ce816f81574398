"""The loop over time steps on a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.compiled import kernel
from solver.kernels.record import Record
from solver.kernels.runge_kutta import (
    AT_REST,
    COLLAPSED,
    GROW,
    NOT_FINITE,
    OUT_OF_STEPS,
    REACHED,
    Progress,
    step_length,
)
from solver.kernels.state import Fields, Grid, Material, Sides
from solver.lattice.spans import Spans, comes_to, copy_surroundings, spread
from solver.lattice.time_stepping import record_maxima
from solver.surface.metric import Metric
from solver.surface.residual import Buffers, stage
from solver.surface.status import classify_surface, moving_volume_exceeds


@kernel()
def empty_drains(
    now: Fields, metric: Metric, spans: Indices, grid: Grid, first: int, last: int, ledger: Array
) -> None:
    """Take what has come to cells where nothing is known of the surface into the ledger, m3."""
    m = grid.stride
    for j in range(first, last + 1):
        for i in range(j * m + spans[0, j], j * m + spans[1, j]):
            side = metric.drain[i]
            if side > 0 and now.h[i] > 0.0:
                ledger[side - 1, 1] += now.h[i] / metric.per_area[i]
                now.h[i] = now.u[i] = now.v[i] = 0.0


@kernel()
def advance_surface(
    now: Fields,
    first_stage: Fields,
    second_stage: Fields,
    before: Fields,
    still: Array,
    metric: Metric,
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

    As `solver.lattice.time_stepping.advance`; what reaches a drain leaves at the end of the step.
    """
    stages = len(parts)
    while progress.time[0] < target:
        if progress.steps[0] >= max_steps:
            return OUT_OF_STEPS
        rate = classify_surface(now, still, metric, material, grid, spans)
        first, last, cells = spread(spans, still, sides, grid)
        started = progress.steps[0] > 0
        if first > last or not moving_volume_exceeds(now, still, spans, metric, grid, rest_volume, started):
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
            about = still, metric, material, grid, spans.stepped, first, last, parts[k], dt
            stage(now, source, out, before, *about, buffers)
            source = out
        progress.time[0] = target if dt == remaining else progress.time[0] + dt
        progress.steps[0] += 1
        progress.cell_stages[0] += stages * cells
        finite = record_maxima(now, spans.stepped, grid, material.dry, threshold, record, progress)
        empty_drains(now, metric, spans.stepped, grid, first, last, progress.ledger)
        if not finite:
            return NOT_FINITE
    return REACHED
