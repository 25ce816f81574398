"""The weighted-residual (conservative) form of LMLS on a cloud: Voronoi faces, LMLS gradients, HLL.

The scheme of `solver.lattice.residual` on cells of any shape: testing eq. 12 with the indicator function of
a control volume gives ``V dU/dt = - sum over faces of (length F*) + V S``. What is the state behind a cell on
a lattice is read off the LMLS gradient at the cell here; where that is the central difference, on a lattice
with supports of five, both schemes are the same.
"""

from __future__ import annotations

import numpy as np

from solver.arrays import Array, Numbers
from solver.cloud.arrays import CloudArrays
from solver.cloud.faces import (
    ROOM,
    Faces,
    beyond,
    carried_over,
    fill_ghosts_beyond,
    half_of,
    own_normals,
)
from solver.cloud.fluxes import CloudBuffers, fluxes_through
from solver.cloud.on_surface import loading, pull_across
from solver.cloud.reconstruction import find_most_slower, flatten_fed, slopes_at
from solver.cloud.sections import admit_into, close_doors, forget_above, measure_faces
from solver.compiled import kernel
from solver.kernels.boundary import account, stopped
from solver.kernels.flow_axes import normal_pressure, sheared
from solver.kernels.friction import law_at
from solver.kernels.limiter import EMPTIED, SMALLEST, TOO_MUCH, afforded, mean_velocity
from solver.kernels.runge_kutta import can_give, weight_of_start
from solver.kernels.source_terms import acting_share, update_cell
from solver.kernels.state import (
    BELOW_YIELD,
    LANES,
    NO_SLIP,
    STILL,
    WALL,
    CloudBed,
    Fields,
    Material,
    Sides,
    Status,
)
from solver.points.voronoi import BUILDING

# A cell that loses more than this share of what it has may be left with less than half of its depth, and then
# pressure acts on a part of it (`ease_pressure`).
EASED = 0.49
# Blocks taken at a time, so that their fluxes are still at hand when their cells are updated.
SEGMENT = 64


@kernel(unaliased=True)
def add_around(halves: Array, around: Numbers, start: int, stop: int, gain: Array) -> None:
    """Add up the half-faces of a run of cells, those that have room in the table.

    Parameters
    ----------
    halves, around, gain
        Of `CloudBuffers`, of `Faces`, and filled as `CloudBuffers` says.
    start, stop : int
        The cells.
    """
    for k in range(start, stop):
        i = np.uint64(k)
        volume = x = y = lost = 0.0
        for m in range(ROOM):
            half = np.uint64(around[np.uint64(m), i])
            into = halves[0, half]
            volume += into
            lost -= into if into < 0.0 else 0.0
            x += halves[1, half]
            y += halves[2, half]
        gain[0, i], gain[1, i], gain[2, i], gain[3, i] = volume, x, y, lost


@kernel()
def add_up(halves: Array, faces: Faces, start: int, stop: int, gain: Array) -> None:
    """Add up the half-faces of a run of cells, as `add_around`, also those beyond the table."""
    add_around(halves, faces.around, start, stop, gain)
    if faces.more[start] == faces.more[stop]:
        return
    for i in range(start, stop):
        for m in range(ROOM, faces.number[i]):
            half = half_of(faces, i, m)
            gain[0, i] += halves[0, half]
            gain[1, i] += halves[1, half]
            gain[2, i] += halves[2, half]
            gain[3, i] -= min(halves[0, half], 0.0)


@kernel()
def outflow_exceeds(
    h: Array, begun: Array, start_weight: float, lost: Array, area: Array, start: int, stop: int, dt: float
) -> bool:
    """Whether some cell of a run would lose more than the share EASED of what it has.

    Parameters
    ----------
    h, begun : arrays
        Depth in this stage and at the start of the step, m.
    start_weight : float
        From `solver.kernels.runge_kutta.weight_of_start`.
    lost, area : arrays
        Volume that leaves each cell (m3 s-1), area (m2).
    start, stop : int
        The cells.
    dt : float
        Time step, s.
    """
    count = 0
    for k in range(start, stop):
        i = np.uint64(k)
        count |= 1 if lost[i] * dt > EASED * can_give(h[i], begun[i], start_weight) * area[i] else 0
    return count > 0


@kernel(inline=True)
def push_on(status: Status, faces: Faces, pressed: Array, f: int, on_left: bool) -> tuple[float, float]:
    """Find what pressure at face f gives the cell on one side of it, along x and y in its frame, m4 s-2."""
    cell = int(faces.left[f]) if on_left else int(faces.right[f])
    push = -faces.geometry[6, f] * pressed[f] if on_left else faces.geometry[6, f] * pressed[f]
    push = 0.0 if status.static[cell] == BELOW_YIELD else push
    left, right = own_normals(faces.far, f, faces.geometry[0, f], faces.geometry[1, f])
    n_x, n_y = left if on_left else right
    x, y = sheared(status.beta_xy, cell, push * n_x, push * n_y)
    return push * n_x * status.beta_x[cell] + x, push * n_y * status.beta_y[cell] + y


@kernel()
def ease_pressure(
    begun: Fields,
    now: Fields,
    start_weight: float,
    status: Status,
    faces: Faces,
    area: Array,
    start: int,
    stop: int,
    dt: float,
    buffers: CloudBuffers,
) -> None:
    """Let pressure act on the share of cells of a run that gravity acts on (`acting_share`).

    Parameters are those of `limit_outflow`, by which all that passes is known.
    """
    gain = buffers.gain
    for i in range(start, stop):
        h = now.h[i]
        acting = acting_share(h, can_give(h + dt * (gain[0, i] / area[i]), begun.h[i], start_weight))
        if acting == 1.0:
            continue
        for m in range(faces.number[i]):
            half = half_of(faces, i, m)
            f, _, _ = beyond(faces, half)
            x, y = push_on(status, faces, buffers.pressed, f, half == f)
            gain[1, i] -= (1.0 - acting) * x
            gain[2, i] -= (1.0 - acting) * y


@kernel()
def limit_outflow(
    begun: Fields,
    now: Fields,
    start_weight: float,
    status: Status,
    faces: Faces,
    area: Array,
    start: int,
    stop: int,
    dt: float,
    buffers: CloudBuffers,
) -> None:
    """Positivity limiter: scale what leaves cells of a run so that a depth is left; flag the blocks around.

    Mass and momentum are those of `solver.kernels.limiter.afforded`; pressure stays.

    Parameters
    ----------
    begun, now : Fields
        State at the start of the step and of this stage.
    start_weight : float
        From `solver.kernels.runge_kutta.weight_of_start`.
    area : (cells,) array
        Of the control volumes, m2.
    start, stop : int
        The cells.
    dt : float
        Time step, s.
    """
    halves, n = buffers.halves, faces.faces
    for i in range(start, stop):
        volume = can_give(now.h[i], begun.h[i], start_weight) * area[i]
        lost = buffers.gain[3, i] * dt / volume if volume > SMALLEST else TOO_MUCH
        if lost > EASED:
            buffers.limited[i // LANES] = 1.0
        if lost <= EMPTIED:
            continue
        u, v = mean_velocity(begun, now, start_weight, i)
        for m in range(faces.number[i]):
            half = half_of(faces, i, m)
            f, j, _ = beyond(faces, half)
            if halves[0, half] >= 0.0:
                continue
            if j < faces.cells:
                buffers.limited[j // LANES] = 1.0
            mass = -halves[0, half]
            normal = faces.geometry[0, f], faces.geometry[1, f]
            push_left = push_on(status, faces, buffers.pressed, f, True)
            push_right = push_on(status, faces, buffers.pressed, f, False)
            push = push_left if half == f else push_right
            out_x, out_y = push[0] - halves[1, half], push[1] - halves[2, half]
            mass, out_x, out_y = afforded((mass, out_x, out_y), lost, u, v)
            # what leaves this cell is what comes to the other
            for side in range(2):
                q = f + side * n
                out = -1.0 if q == half else 1.0
                to_x, to_y = out_x, out_y
                if q != half:
                    to_x, to_y = carried_over(faces.far, f, normal, side == 0, out_x, out_y)
                halves[0, q] = out * mass
                push = push_left if side == 0 else push_right
                halves[1, q] = out * to_x + push[0]
                halves[2, q] = out * to_y + push[1]


@kernel()
def stop_at_walls(
    now: Fields,
    status: Status,
    faces: Faces,
    sides: Sides,
    area: Array,
    buffers: CloudBuffers,
    start: int,
    stop: int,
    dt: float,
) -> None:
    """Bound what walls across the bed take from layers too thin to lean on them, as `boundary.stopped` does.

    Parameters
    ----------
    area : (cells,) array
        Of the control volumes, m2.
    start, stop : int
        Numbers of the boundary faces.
    dt : float
        Time step, s.
    """
    halves = buffers.halves
    for b in range(start, stop):
        f = faces.outer + b
        if sides.kind[faces.side[b]] not in (WALL, NO_SLIP):
            continue
        i, n_x, n_y, length = (
            int(faces.left[f]),
            faces.geometry[0, f],
            faces.geometry[1, f],
            faces.geometry[6, f],
        )
        beta = normal_pressure(status.beta_xy, i, status.beta_x[i], status.beta_y[i], n_x, n_y)
        if faces.lean[b] / beta <= now.h[i]:
            continue
        free = 0.0 if status.static[i] == BELOW_YIELD else 1.0
        pressed = free * beta * length * buffers.pressed[f]
        toward, aside = n_x * halves[1, f] + n_y * halves[2, f], n_x * halves[2, f] - n_y * halves[1, f]
        impulse = (-toward - pressed) / length
        bound = stopped(impulse, now.h[i] * (n_x * now.u[i] + n_y * now.v[i]), area[i] / length, dt)
        if bound < impulse:
            toward = -length * bound - pressed
            halves[1, f], halves[2, f] = n_x * toward - n_y * aside, n_y * toward + n_x * aside


@kernel()
def update_run(
    start: Fields,
    now: Fields,
    out: Fields,
    status: Status,
    bed: CloudBed,
    material: Material,
    area: Array,
    gain: Array,
    first: int,
    last: int,
    part: float,
    dt: float,
) -> None:
    """Update a run of cells, as `solver.kernels.source_terms.update_cell` does one.

    Parameters
    ----------
    gain
        (4, cells) array, sums over the faces of a cell, pressure among them, as of `CloudBuffers`.
    """
    start_weight = weight_of_start(part)
    for k in range(first, last):
        i = np.uint64(k)
        h, over = now.h[i], 1.0 / area[i]
        transport = gain[0, i] * over, gain[1, i] * over, gain[2, i] * over
        load = h * acting_share(h, can_give(h + dt * transport[0], start.h[i], start_weight))
        free, u, v = 0.0 if status.static[i] == BELOW_YIELD else 1.0, now.u[i], now.v[i]
        out.h[i], out.u[i], out.v[i] = update_cell(
            (start.h[i], start.u[i], start.v[i]),
            (h, u, v),
            transport,
            (free * (bed.along[i] * load), free * (pull_across(bed.lift, i) * load)),
            loading(bed.lift, bed.normal[i], bed.curvature[i], i, u, v),
            load,
            part,
            dt,
            law_at(material.law, i),
            material.dry,
            STILL * material.dry,
        )


@kernel()
def cloud_stage(
    arrays: CloudArrays,
    now: Fields,
    out: Fields,
    part: float,
    share: float,
    dt: float,
    ledger: Array,
    sloped: bool,
) -> None:
    """One Runge-Kutta stage, as `solver.lattice.residual.stage`.

    Parameters
    ----------
    now, out : Fields
        State of this stage, and to be filled, which may not be that at the start of the step.
    sloped : bool
        Whether the slopes of ``now`` are there already.
    """
    start, status, bed, material, sides = arrays.now, arrays.status, arrays.bed, arrays.material, arrays.sides
    area, faces, gradient = arrays.area, arrays.faces, arrays.gradient
    activity, buffers, start_weight = arrays.activity, arrays.buffers, weight_of_start(part)
    inflows, doors = arrays.inflows, arrays.doors
    first, first_side, runs = faces.first, faces.first_side, activity.stepped_runs
    if not sloped:
        for r in range(activity.counts[2]):
            a, b = activity.sloped_runs[r]
            slopes_at(now, gradient, a, b, material.dry, buffers.slopes)
            find_most_slower(now, bed.normal, a, b, buffers.slopes)
            forget_above(now, gradient, doors, a, b, material.dry, buffers.slopes)
            flatten_fed(buffers.slopes, faces, sides, first_side[a // LANES], first_side[b // LANES])
    # boundary faces are few: all from the first to the last that take part
    a, b = first_side[runs[0, 0] // LANES], first_side[runs[activity.counts[0] - 1, 1] // LANES]
    fill_ghosts_beyond(now, status, faces, sides, a, b)
    fluxes_through(now, status, faces, sides, material.dry, buffers, faces.outer + a, faces.outer + b)
    stop_at_walls(now, status, faces, sides, area, buffers, a, b, dt)
    close_doors(inflows, doors, now, status, faces, buffers, faces.outer + a, faces.outer + b, dt)
    at, limited = 0, False
    for r in range(activity.counts[1]):
        low, high = activity.fluxed_runs[r, 0] // LANES, activity.fluxed_runs[r, 1] // LANES
        for block in range(low, high, SEGMENT):
            a, b = block, min(block + SEGMENT, high)
            fluxes_through(now, status, faces, sides, material.dry, buffers, first[a], first[b])
            close_doors(inflows, doors, now, status, faces, buffers, first[a], first[b], dt)
            # a cell is on the right of faces of earlier blocks only, so that those here are complete
            while at < activity.counts[0] and runs[at, 0] < b * LANES:
                one, two = max(runs[at, 0], a * LANES), min(runs[at, 1], b * LANES)
                add_up(buffers.halves, faces, one, two, buffers.gain)
                limited |= outflow_exceeds(now.h, start.h, start_weight, buffers.gain[3], area, one, two, dt)
                update_run(start, now, out, status, bed, material, area, buffers.gain, one, two, part, dt)
                if runs[at, 1] > b * LANES:
                    break
                at += 1
    if limited:
        for r in range(activity.counts[0]):
            limit_outflow(start, now, start_weight, status, faces, area, runs[r, 0], runs[r, 1], dt, buffers)
    for e in range(len(doors.face)):
        # such cells are stepped; of others what is at hand is of steps before
        if inflows.flowing[inflows.section[e]] > 0.0:
            limited = True
            buffers.limited[inflows.cell[e] // LANES] = 1.0
    if limited:
        for block in range(len(buffers.limited)):
            if buffers.limited[block] > 0.0:
                one, two = block * LANES, (block + 1) * LANES
                add_up(buffers.halves, faces, one, two, buffers.gain)
                ease_pressure(start, now, start_weight, status, faces, area, one, two, dt, buffers)
                if len(doors.face) > 0:
                    admit_into(inflows, doors, block, now, status, faces, buffers, dt)
                update_run(start, now, out, status, bed, material, area, buffers.gain, one, two, part, dt)
                buffers.limited[block] = 0.0
    for r in range(activity.counts[0]):
        for s in range(first_side[runs[r, 0] // LANES], first_side[runs[r, 1] // LANES]):
            # nothing passes a wall of a building
            if faces.side[s] < BUILDING:
                account(-buffers.halves[0, faces.outer + s] * share * dt, faces.side[s], ledger)
    measure_faces(arrays.sections, faces, activity, buffers.halves, share * dt)
