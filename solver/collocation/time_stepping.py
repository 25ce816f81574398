"""The parts of a time step of the collocation form, as `solver.lattice.time_stepping` has them."""

from __future__ import annotations

from solver.arrays import Array
from solver.collocation.arrays import CollocationArrays
from solver.collocation.relaxation import relax
from solver.collocation.residual import (
    account_open,
    choose,
    derivatives,
    fill_images,
    set_pressure,
    update,
    velocities,
)
from solver.compiled import ZERO, kernel
from solver.kernels.record import record_cells
from solver.kernels.runge_kutta import (
    AT_REST,
    CONTINUE,
    NOT_FINITE,
    SSP_RK3,
    Limits,
    Progress,
    march,
    share_of_step,
)
from solver.kernels.state import Fields


@kernel()
def moving_volume(now: Fields, area: Array, dry: float, count: int) -> float:
    """Volume of what is wet and has a velocity, m3."""
    total = 0.0
    for i in range(count):
        if now.h[i] > dry and (now.u[i] != 0.0 or now.v[i] != 0.0):
            total += now.h[i] * area[i]
    return total


@kernel(as_source=True, cached=False)
def differentiate(arrays: CollocationArrays, count: int) -> int:
    """Choose the points to be stepped, count of them before, and take derivatives there; count them."""
    now, stencils, images, scratch = arrays.now, arrays.stencils, arrays.images, arrays.scratch
    fill_images(now.h, now.u, now.v, images)
    count = choose(now.h, arrays.material.dry, count, stencils, images, scratch.mark, scratch.chosen)
    derivatives(now, scratch.chosen[:count], stencils, scratch.gains)
    return count


@kernel(as_source=True, cached=False)
def begin_step(arrays: CollocationArrays, limits: Limits, progress: Progress) -> tuple[int, float, int]:
    """Set the earth pressure, and find the largest wave rate, s-1."""
    now, scratch = arrays.now, arrays.scratch
    start = scratch.start
    for i in range(len(start.h)):
        start.h[i], start.u[i], start.v[i] = now.h[i], now.u[i], now.v[i]
    count = differentiate(arrays, ZERO)
    chosen = scratch.chosen[:count]
    rate = set_pressure(now, chosen, arrays.stencils, arrays.bed, arrays.material, scratch.beta)
    return CONTINUE, rate, count


@kernel(as_source=True, cached=False)
def take_step(arrays: CollocationArrays, count: int, dt: float, progress: Progress) -> None:
    """Take the stages of a step; the first one finds the derivatives there."""
    now, scratch, material = arrays.now, arrays.scratch, arrays.material
    for k in range(len(SSP_RK3)):
        if k > 0:
            count = differentiate(arrays, count)
        account_open(now, arrays.open, share_of_step(SSP_RK3, k) * dt, progress.ledger)
        update(now, scratch.chosen[:count], arrays.bed, material, SSP_RK3[k], dt, scratch)
        progress.cell_stages[0] += count
        count = relax(arrays, count)
        chosen, film = scratch.chosen[:count], arrays.film
        velocities(scratch.q, chosen, arrays.stencils, material.dry, film, arrays.around, now)


@kernel(as_source=True, cached=False)
def end_step(arrays: CollocationArrays, limits: Limits, progress: Progress) -> int:
    """Record the maxima, and look for values that are not finite and for rest."""
    now, dry, n = arrays.now, arrays.material.dry, len(arrays.scratch.chosen)
    if not record_cells(now, ZERO, n, dry, limits.arrival_depth, arrays.record, progress):
        return NOT_FINITE
    return AT_REST if moving_volume(now, arrays.area, dry, n) <= limits.rest_volume else CONTINUE


@kernel(from_python=True)
def advance_collocation(arrays: CollocationArrays, limits: Limits, progress: Progress) -> int:
    """Step until a limit; return which."""
    return int(march(arrays, begin_step, take_step, end_step, limits, progress))
