"""The time loop on a cloud, as `solver.lattice.time_stepping.advance` is that on a lattice."""

from __future__ import annotations

from solver.arrays import Array, Indices
from solver.cloud.blocks import Activity, Blocks, moving_volume_exceeds, spread_blocks
from solver.cloud.faces import Faces
from solver.cloud.fluxes import CloudBuffers
from solver.cloud.reconstruction import Gradient
from solver.cloud.residual import cloud_stage
from solver.cloud.status import classify_cloud
from solver.compiled import kernel
from solver.kernels.record import Record, record_cells
from solver.kernels.runge_kutta import (
    AT_REST,
    COLLAPSED,
    NOT_FINITE,
    OUT_OF_STEPS,
    REACHED,
    Progress,
    share_of_step,
    step_length,
)
from solver.kernels.state import CloudBed, Fields, Material, Sides, Status


@kernel()
def copy_runs(source: Fields, target: Fields, runs: Indices) -> None:
    """Copy runs of cells."""
    for start, stop in runs:
        target.h[start:stop] = source.h[start:stop]
        target.u[start:stop] = source.u[start:stop]
        target.v[start:stop] = source.v[start:stop]


@kernel()
def advance_cloud(
    now: Fields,
    first_stage: Fields,
    second_stage: Fields,
    status: Status,
    bed: CloudBed,
    material: Material,
    sides: Sides,
    area: Array,
    widths: Array,
    faces: Faces,
    gradient: Gradient,
    blocks: Blocks,
    activity: Activity,
    buffers: CloudBuffers,
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

    Between steps the three states are equal, so that a stage finds in its own what it reads beside the cells
    it steps. The last stage fills another state than the one it starts from: its loop could not vectorise.
    """
    stages = len(parts)
    for stage in (first_stage, second_stage):
        stage.h[:], stage.u[:], stage.v[:] = now.h, now.u, now.v
    while progress.time[0] < target:
        # before anything is touched, so that the run can go on from here as if it had not stopped
        if progress.steps[0] >= max_steps:
            return OUT_OF_STEPS
        rate = classify_cloud(
            now,
            buffers.slopes,
            status,
            bed,
            material,
            sides,
            faces,
            gradient,
            area,
            widths,
            activity,
            buffers.rate,
        )
        cells = spread_blocks(status.static, faces, blocks, activity)
        started = progress.steps[0] > 0
        if not moving_volume_exceeds(now, status, area, sides, faces, activity, rest_volume, started):
            return AT_REST
        remaining = target - progress.time[0]
        dt = step_length(rate, cfl, remaining, shortest)
        if dt == 0.0:
            return COLLAPSED
        source = now
        for k in range(stages):
            out = first_stage if k % 2 == 0 else second_stage
            cloud_stage(
                now,
                source,
                out,
                status,
                bed,
                material,
                sides,
                area,
                faces,
                gradient,
                activity,
                parts[k],
                share_of_step(parts, k),
                dt,
                buffers,
                progress.ledger,
                k == 0,
            )
            source = out
        runs = activity.stepped_runs[: activity.counts[0]]
        copy_runs(first_stage, now, runs)
        copy_runs(first_stage, second_stage, runs)
        progress.time[0] = target if dt == remaining else progress.time[0] + dt
        progress.steps[0] += 1
        progress.cell_stages[0] += stages * cells
        for start, stop in runs:
            if not record_cells(now, start, stop, material.dry, threshold, record, progress):
                return NOT_FINITE
    return REACHED
