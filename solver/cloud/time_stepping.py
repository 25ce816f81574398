"""The parts of a time step on a cloud, as `solver.lattice.time_stepping` has them on a lattice."""

from __future__ import annotations

import numpy as np

from solver.arrays import Indices
from solver.cloud.arrays import CloudArrays
from solver.cloud.blocks import spread_blocks
from solver.cloud.on_surface import empty_drains, loading, pull_across
from solver.cloud.residual import cloud_stage
from solver.cloud.sections import open_blocks
from solver.cloud.status import classify_cloud
from solver.compiled import kernel
from solver.kernels.boundary import drive_layers
from solver.kernels.erosion import entrain, erode_cell
from solver.kernels.record import record_cells
from solver.kernels.runge_kutta import (
    AT_REST,
    CONTINUE,
    NOT_FINITE,
    SSP_RK3,
    Limits,
    Progress,
    less_moving,
    march,
    share_of_step,
)
from solver.kernels.sections.inflow import await_inflow, begin_inflow
from solver.kernels.sections.measured import sample
from solver.kernels.state import DEPTH, LANES, Fields


@kernel(unaliased=True)
def copy_runs(source: Fields, target: Fields, runs: Indices) -> None:
    """Copy runs of cells."""
    for r in range(len(runs)):
        for k in range(runs[r, 0], runs[r, 1]):
            i = np.uint64(k)
            target.h[i], target.u[i], target.v[i] = source.h[i], source.u[i], source.v[i]


@kernel(fastmath=False)
def erode(arrays: CloudArrays, state: Fields, dt: float) -> None:
    """Let the cells that were not static at the start of a step erode, over its length, s.

    ``state`` is that after the last stage.
    """
    bed, erosion = arrays.bed, arrays.erosion
    for start, stop in arrays.activity.stepped_runs[: arrays.activity.counts[0]]:
        for i in range(start, stop):
            if arrays.status.static[i] != 0.0 or state.h[i] <= arrays.material.dry:
                continue
            u, v = state.u[i], state.v[i]
            normal, curvature = loading(bed.lift, bed.normal[i], bed.curvature[i], i, u, v)
            h, u, v, more = erode_cell(
                erosion,
                i,
                (state.h[i], u, v),
                (bed.along[i], pull_across(bed.lift, i), bed.normal[i]),
                max(0.0, normal + curvature * (u * u)),
                dt,
                arrays.material,
            )
            state.h[i], state.u[i], state.v[i] = h, u, v
            entrain(more * arrays.area[i], erosion.entrained)


@kernel(as_source=True, cached=False)
def moving_volume_exceeds(arrays: CloudArrays, volume: float, started: bool) -> bool:
    """As `solver.lattice.spans.moving_volume_exceeds`."""
    now, static, area, activity = arrays.now, arrays.status.static, arrays.area, arrays.activity
    faces, kind = arrays.faces, arrays.sides.kind
    moves = not started
    for r in range(activity.counts[0]):
        start, stop = activity.stepped_runs[r]
        for i in range(start, stop):
            amount = now.h[i] * area[i]
            volume, moves = less_moving(volume, moves, static[i], amount, now.u[i], now.v[i])
            if moves and volume < 0.0:
                return True
        for b in range(faces.first_side[start // LANES], faces.first_side[stop // LANES]):
            if kind[faces.side[b]] == DEPTH and static[faces.cells + b] == 0.0:
                return True
    return False


@kernel(as_source=True, cached=False)
def begin_step(arrays: CloudArrays, limits: Limits, progress: Progress) -> tuple[int, float, int]:
    """Find what is to be stepped, whether anything moves, and the largest wave rate, s-1."""
    drive_layers(arrays.sides, progress.time[0])
    rate = classify_cloud(arrays)
    waits = progress.time[0] < arrays.inflows.until[0]
    if waits:
        rate = await_inflow(arrays.inflows, progress.time[0], limits, rate)
        open_blocks(arrays.inflows, arrays.status.static, arrays.activity.moving)
    cells = spread_blocks(arrays.status.static, arrays.faces, arrays.blocks, arrays.activity)
    moves = waits or moving_volume_exceeds(arrays, limits.rest_volume, progress.steps[0] > 0)
    return CONTINUE if moves else AT_REST, rate, cells


@kernel(as_source=True, cached=False)
def take_step(arrays: CloudArrays, cells: int, dt: float, progress: Progress) -> None:
    """Take the stages of a step.

    The last one fills another state than that at the start of the step: its loop could not vectorise.
    """
    now, one, two = arrays.now, arrays.first_stage, arrays.second_stage
    drive_layers(arrays.sides, progress.time[0] + dt)
    if len(arrays.inflows.cell) > 0:
        begin_inflow(arrays.inflows, progress.time[0], dt)
    for k in range(len(SSP_RK3)):
        source = now if k == 0 else (one if k % 2 == 1 else two)
        out = one if k % 2 == 0 else two
        weights = SSP_RK3[k], share_of_step(SSP_RK3, k)
        if cells > 0:
            cloud_stage(arrays, source, out, *weights, dt, progress.ledger, k == 0)
        progress.cell_stages[0] += cells
    if arrays.erosion.available.size > 0:
        erode(arrays, one, dt)
    runs = arrays.activity.stepped_runs[: arrays.activity.counts[0]]
    copy_runs(one, now, runs)
    copy_runs(one, two, runs)


@kernel(as_source=True, cached=False)
def end_step(arrays: CloudArrays, limits: Limits, progress: Progress) -> int:
    """Record the maxima and what passed sections, and look for values that are not finite."""
    if len(arrays.sections.volume) > 0:
        sample(arrays.sections, progress.time[0])
    dry, threshold = arrays.material.dry, limits.arrival_depth
    for start, stop in arrays.activity.stepped_runs[: arrays.activity.counts[0]]:
        if not record_cells(arrays.now, start, stop, dry, threshold, arrays.record, progress):
            return NOT_FINITE
    states = arrays.now, arrays.first_stage, arrays.second_stage
    empty_drains(arrays.bed.lift, states, arrays.area, arrays.activity, progress.ledger)
    return CONTINUE


@kernel(from_python=True)
def advance_cloud_on_surface(arrays: CloudArrays, limits: Limits, progress: Progress) -> int:
    """Step until a limit, where the bed is a surface; return which."""
    return int(march(arrays, begin_step, take_step, end_step, limits, progress))


@kernel(from_python=True)
def advance_cloud(arrays: CloudArrays, limits: Limits, progress: Progress) -> int:
    """Step until a limit; return which."""
    return int(march(arrays, begin_step, take_step, end_step, limits, progress))
