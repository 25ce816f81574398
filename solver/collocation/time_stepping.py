"""The time loop of the collocation form, as `solver.lattice.time_stepping.advance` is that of the lattice."""

from __future__ import annotations

from solver.arrays import Array
from solver.collocation.operators import Stencils
from solver.collocation.relaxation import Relaxation, relax
from solver.collocation.residual import (
    Images,
    Open,
    Scratch,
    account_open,
    choose,
    derivatives,
    fill_images,
    set_pressure,
    update,
    velocities,
)
from solver.compiled import ZERO, kernel
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
from solver.kernels.state import CloudBed, Fields, Material


@kernel()
def moving_volume(now: Fields, area: Array, dry: float, count: int) -> float:
    """Volume of what is wet and has a velocity, m3."""
    total = 0.0
    for i in range(count):
        if now.h[i] > dry and (now.u[i] != 0.0 or now.v[i] != 0.0):
            total += now.h[i] * area[i]
    return total


@kernel()
def advance_collocation(
    now: Fields,
    coordinates: Array,
    area: Array,
    stencils: Stencils,
    images: Images,
    sides: Open,
    bed: CloudBed,
    material: Material,
    how: Relaxation,
    film: float,
    around: int,
    scratch: Scratch,
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
    """Step until ``target`` (s) or until at most ``rest_volume`` (m3) moves; return why it stopped."""
    n, dry, start = len(scratch.chosen), material.dry, scratch.start
    while progress.time[0] < target:
        if progress.steps[0] >= max_steps:
            return OUT_OF_STEPS
        remaining, dt, count = target - progress.time[0], 0.0, ZERO
        start.h[:], start.u[:], start.v[:] = now.h, now.u, now.v
        for k in range(len(parts)):
            fill_images(now.h, now.u, now.v, images)
            count = choose(now.h, dry, count, stencils, images, scratch.mark, scratch.chosen)
            chosen = scratch.chosen[:count]
            derivatives(now, chosen, stencils, scratch.gains)
            if k == 0:
                rate = set_pressure(now, chosen, stencils, bed, material, scratch.beta)
                dt = step_length(rate, cfl, remaining, shortest)
                if dt == 0.0:
                    return COLLAPSED
            account_open(now, sides, share_of_step(parts, k) * dt, progress.ledger)
            update(now, chosen, bed, material, parts[k], dt, scratch)
            progress.cell_stages[0] += count
            count = relax(count, coordinates, area, stencils, images, bed, dry, how, scratch)
            velocities(scratch.q, scratch.chosen[:count], stencils, dry, film, around, now)
        progress.time[0] = target if dt == remaining else progress.time[0] + dt
        progress.steps[0] += 1
        if not record_cells(now, ZERO, n, dry, threshold, record, progress):
            return NOT_FINITE
        if moving_volume(now, area, dry, n) <= rest_volume:
            return AT_REST
    return REACHED
