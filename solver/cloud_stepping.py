"""The time loop on a cloud, as `solver.time_stepping.advance` is that on a lattice."""

from __future__ import annotations

import math

from solver.activity import Material, Status
from solver.boundary import Fields, Sides
from solver.cloud_activity import CloudBed, Gradient, Stepped, classify_cloud, moving_volume_exceeds
from solver.cloud_faces import Faces
from solver.cloud_residual import CloudBuffers, cloud_stage
from solver.compiled import Array, Indices, kernel
from solver.time_stepping import (
    AT_REST,
    COLLAPSED,
    NOT_FINITE,
    OUT_OF_STEPS,
    REACHED,
    Progress,
    Record,
    record_run,
    share_of_step,
    step_length,
)


@kernel(fastmath=False)
def record_cells(
    now: Fields, n: int, dry: float, threshold: float, record: Record, progress: Progress
) -> bool:
    """Update the maxima of all n cells; on a value that is not finite, note its cell."""
    if record_run(now, 0, n, dry, threshold, progress.time[0], record, 0):
        return True
    for i in range(n):
        if not math.isfinite(now.h[i] * (now.u[i] ** 2 + now.v[i] ** 2)):
            progress.place[0] = i
            break
    return False


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
    faces: Faces,
    gradient: Gradient,
    buffers: CloudBuffers,
    ring: Indices,
    lists: Indices,
    parts: tuple[float, ...],
    cfl: float,
    target: float,
    end: float,
    max_steps: int,
    rest_volume: float,
    threshold: float,
    record: Record,
    progress: Progress,
) -> int:
    """Step until ``target`` (s) or until at most ``rest_volume`` (m3) moves; return why it stopped."""
    stages, n = len(parts), len(area)
    while progress.time[0] < target:
        if progress.steps[0] >= max_steps:
            return OUT_OF_STEPS
        rate, cells, stepped_faces, sloped = classify_cloud(
            now, status, bed, material, sides, area, faces, gradient, buffers.slopes, ring, lists
        )
        if cells == 0 or not moving_volume_exceeds(now.h, status.still, area, sides, faces, rest_volume):
            return AT_REST
        remaining = target - progress.time[0]
        dt = step_length(rate, cfl, remaining, end)
        if dt == 0.0:
            return COLLAPSED
        stepped = Stepped(lists[0, :cells], lists[1, :stepped_faces], lists[2, :sloped])
        for stage in (first_stage, second_stage):
            stage.h[:], stage.u[:], stage.v[:] = now.h, now.u, now.v
        source = now
        for k in range(stages):
            out = now if k == stages - 1 else (first_stage if k % 2 == 0 else second_stage)
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
                stepped,
                parts[k],
                share_of_step(parts, k),
                dt,
                buffers,
                progress.ledger,
                k == 0,
            )
            source = out
        progress.time[0] = target if dt == remaining else progress.time[0] + dt
        progress.steps[0] += 1
        progress.cell_stages[0] += stages * cells
        if not record_cells(now, n, material.dry, threshold, record, progress):
            return NOT_FINITE
    return REACHED
