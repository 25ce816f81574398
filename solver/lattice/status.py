"""Which cells take part in a step: what is dry, what is below yield, what its neighbours can reach."""

from __future__ import annotations

import math

import numpy as np

from solver.arrays import Array
from solver.compiled import ONE, kernel
from solver.kernels.boundary import status_at_depth
from solver.kernels.earth_pressure import earth_pressure, stretching, wave_speed
from solver.kernels.flow_axes import pressure_along_axes, strain_along_axes, traction_axes
from solver.kernels.friction import below_yield, faces_below_yield, law_at, raised_rate
from solver.kernels.runge_kutta import raised_by_fall
from solver.kernels.state import (
    AXIS,
    BELOW_YIELD,
    DEPTH,
    DRY,
    GHOSTS,
    Bed,
    Fields,
    Grid,
    Material,
    Sides,
    Status,
    may_flow,
    share_of_speed,
    square_above,
)
from solver.lattice.ghosts import fill_ghosts
from solver.lattice.spans import Spans, trim


@kernel(unaliased=True)
def bound_films(now: Fields, dry: float, stride: int, cell: int, count: int) -> None:
    """Bound the speed of the dry cells of a run by that of deeper ones beside them: without one they stop.

    Beside a flow a film moves on. If it stopped there, the flow would take it up at rest in the next step,
    and be braked by it: along its sides in every step, the more the finer the lattice.

    Parameters
    ----------
    now : Fields
        The state, of which the velocity is changed.
    dry : float
        Depth up to which a cell counts as dry, m.
    stride : int
        Distance to the next row.
    cell, count : int
        Index of the first cell, number of cells.
    """
    h, u, v = now
    films = 0
    for k in range(count):
        at = np.uint64(cell) + np.uint64(k)
        films |= 1 if (h[at] <= dry) & ((u[at] != 0.0) | (v[at] != 0.0)) else 0
    if films == 0:
        return
    for i in range(cell, cell + count):
        if h[i] > dry or (u[i] == 0.0 and v[i] == 0.0):
            continue
        most = 0.0
        for j in (i - 1, i + 1, i - stride, i + stride):
            most = max(most, square_above(h[j], u[j], v[j], dry))
        share = share_of_speed(u[i], v[i], most)
        u[i], v[i] = share * u[i], share * v[i]


@kernel(unaliased=True)
def fix_pressure(
    now: Fields,
    status: Status,
    bed: Bed,
    material: Material,
    grid: Grid,
    rate: Array,
    cell: int,
    column: int,
    count: int,
) -> None:
    """Set the earth pressure of a run of cells, the same in every state, and raise the rate of columns.

    Parameters are those of `classify_run`.
    """
    h, u, v = now
    k_x, k_y, dry = material.pressure[0], material.pressure[2], material.dry
    over_x, over_y = 1.0 / grid.dx, 1.0 / grid.dy
    for k in range(count):
        i, c = np.uint64(cell) + np.uint64(k), np.uint64(column) + np.uint64(k)
        b_x, b_y = bed.normal[c] * k_x, bed.normal[c] * k_y
        status.beta_x[i], status.beta_y[i] = b_x, b_y
        this = (abs(u[i]) + math.sqrt(b_x * h[i])) * over_x + (abs(v[i]) + math.sqrt(b_y * h[i])) * over_y
        this = raised_by_fall(this, abs(u[i]) * over_x + abs(v[i]) * over_y, bed.falling[c])
        this = raised_rate(law_at(material.law, i), this, h[i], bed.normal[c], dry)
        this = this if may_flow(h[i], u[i], v[i], dry) else 0.0
        rate[c] = this if this > rate[c] else rate[c]


@kernel(unaliased=True)
def choose_pressure(
    now: Fields,
    status: Status,
    bed: Bed,
    material: Material,
    grid: Grid,
    rate: Array,
    cell: int,
    column: int,
    count: int,
) -> None:
    """Choose the earth pressure of a run of cells by how they are stretched, and raise the rate of columns.

    A dry neighbour has no velocity of its own and does not make a velocity gradient; what is dry itself has
    the pressure of rest. Parameters are those of `classify_run`.
    """
    h, u, v = now
    dry, one, row = material.dry, np.uint64(1), np.uint64(grid.stride)
    over_x, over_y = 1.0 / grid.dx, 1.0 / grid.dy
    half_x, half_y = 0.5 * over_x, 0.5 * over_y
    for k in range(count):
        i, c = np.uint64(cell) + np.uint64(k), np.uint64(column) + np.uint64(k)
        w, e, s, n = i - one, i + one, i - row, i + row
        wet = h[i] > dry
        # loaded before they are chosen from: a choice of address would be gathered
        u_i, u_e, u_w, v_i, v_n, v_s = u[i], u[e], u[w], v[i], v[n], v[s]
        u_e, u_w = u_e if h[e] > dry else u_i, u_w if h[w] > dry else u_i
        v_n, v_s = v_n if h[n] > dry else v_i, v_s if h[s] > dry else v_i
        rise_x, rise_y = half_x * (h[e] - h[w]), half_y * (h[n] - h[s])
        b_x, b_y, wave_x, wave_y = earth_pressure(
            stretching(half_x * (u_e - u_w), half_x * ((u_e - u_i) - (u_i - u_w)), rise_x),
            stretching(half_y * (v_n - v_s), half_y * ((v_n - v_i) - (v_i - v_s)), rise_y),
            bed.steepness[c] * math.sqrt(h[i]) if wet else 0.0,
            bed.normal[c],
            abs(rise_x),
            abs(rise_y),
            material,
        )
        status.beta_x[i], status.beta_y[i] = b_x, b_y
        this = (abs(u_i) + wave_speed(wave_x, b_x, h[i])) * over_x
        this += (abs(v_i) + wave_speed(wave_y, b_y, h[i])) * over_y
        this = raised_by_fall(this, abs(u_i) * over_x + abs(v_i) * over_y, bed.falling[c])
        this = raised_rate(law_at(material.law, i), this, h[i], bed.normal[c], dry)
        this = this if may_flow(h[i], u_i, v_i, dry) else 0.0
        rate[c] = this if this > rate[c] else rate[c]


@kernel(unaliased=True)
def classify_run(
    now: Fields,
    status: Status,
    bed: Bed,
    material: Material,
    grid: Grid,
    rate: Array,
    cell: int,
    column: int,
    count: int,
) -> None:
    """Set earth pressure and status of a run of cells, and raise the wave rate of their columns.

    A cell is static if it is dry and no film that moves, or at rest with
    ``|(beta_x h_x - g sin xi, beta_y h_y)|`` at most ``R(0, h)``, of dry friction ``g cos xi tan delta``, at
    each of its faces: were it asked of the whole cell alone, a spike one cell wide would stand.

    Parameters
    ----------
    rate : (nx + 4,) array
        Largest wave rate of each column, s-1, raised in place.
    cell, column, count : int
        Index of the first cell, its column, number of cells.
    """
    set_pressure(status.beta_xy, now, status, bed, material, grid, rate, cell, column, count)
    h, u, v = now
    dry, one, row = material.dry, np.uint64(1), np.uint64(grid.stride)
    over_x, over_y = 1.0 / grid.dx, 1.0 / grid.dy
    for k in range(count):
        i, c = np.uint64(cell) + np.uint64(k), np.uint64(column) + np.uint64(k)
        w, e, s, n = i - one, i + one, i - row, i + row
        b_x, b_y = status.beta_x[i], status.beta_y[i]
        # the slope at each face, with that of the whole cell in the other direction
        pull = bed.along[c]
        back_x, forth_x = b_x * (h[i] - h[w]) * over_x - pull, b_x * (h[e] - h[i]) * over_x - pull
        back_y, forth_y = b_y * (h[i] - h[s]) * over_y, b_y * (h[n] - h[i]) * over_y
        back, forth, behind, ahead = (back_x, back_y), (forth_x, forth_y), (h[w], h[s]), (h[e], h[n])
        rests = u[i] * u[i] + v[i] * v[i] == 0.0
        rests &= faces_below_yield(law_at(material.law, i), back, forth, h[i], behind, ahead, bed.normal[c])
        static = BELOW_YIELD if rests else 0.0
        status.static[i] = static if may_flow(h[i], u[i], v[i], dry) else DRY
    hold_along_flow(status.beta_xy, now, status, bed, material, grid, cell, column, count)


@kernel()
def set_pressure(
    shear: Array | None,
    now: Fields,
    status: Status,
    bed: Bed,
    material: Material,
    grid: Grid,
    rate: Array,
    cell: int,
    column: int,
    count: int,
) -> None:
    """Set the earth pressure of a run of cells by the law; ``shear`` is ``beta_xy`` of the status."""
    if shear is None:
        if material.transition[1] > 0.0:
            choose_pressure(now, status, bed, material, grid, rate, cell, column, count)
        else:
            fix_pressure(now, status, bed, material, grid, rate, cell, column, count)
    else:
        choose_along_flow(shear, now, status, bed, material, grid, rate, cell, column, count)


@kernel(unaliased=True)
def choose_along_flow(
    shear: Array,
    now: Fields,
    status: Status,
    bed: Bed,
    material: Material,
    grid: Grid,
    rate: Array,
    cell: int,
    column: int,
    count: int,
) -> None:
    """Set the earth pressure of a run of cells with the axes of the flow, as `choose_pressure` otherwise.

    What is dry has the pressure of rest along the way that it will be pushed, whatever that is.

    Parameters
    ----------
    shear : flat array
        ``beta_xy`` of the status, filled.
    """
    h, u, v = now
    dry, one, row = material.dry, np.uint64(1), np.uint64(grid.stride)
    over_x, over_y = 1.0 / grid.dx, 1.0 / grid.dy
    half_x, half_y = 0.5 * over_x, 0.5 * over_y
    for k in range(count):
        i, c = np.uint64(cell) + np.uint64(k), np.uint64(column) + np.uint64(k)
        w, e, s, n = i - one, i + one, i - row, i + row
        h_i, u_i, v_i, normal = h[i], u[i], v[i], bed.normal[c]
        wet, wet_e, wet_w, wet_n, wet_s = h_i > dry, h[e] > dry, h[w] > dry, h[n] > dry, h[s] > dry
        # loaded before they are chosen from: a choice of address would be gathered
        u_e, u_w, u_n, u_s, v_e, v_w, v_n, v_s = u[e], u[w], u[n], u[s], v[e], v[w], v[n], v[s]
        forth_ux, back_ux = u_e - u_i if wet_e else 0.0, u_i - u_w if wet_w else 0.0
        forth_vx, back_vx = v_e - v_i if wet_e else 0.0, v_i - v_w if wet_w else 0.0
        forth_uy, back_uy = u_n - u_i if wet_n else 0.0, u_i - u_s if wet_s else 0.0
        forth_vy, back_vy = v_n - v_i if wet_n else 0.0, v_i - v_s if wet_s else 0.0
        rise = half_x * (h[e] - h[w]), half_y * (h[n] - h[s])
        axes = traction_axes((u_i, v_i), h_i, (bed.along[c], 0.0), normal, rise, wet)
        along, across = strain_along_axes(
            axes,
            (half_x * (forth_ux + back_ux), half_x * (forth_vx + back_vx)),
            (half_y * (forth_uy + back_uy), half_y * (forth_vy + back_vy)),
            (half_x * (forth_ux - back_ux), half_x * (forth_vx - back_vx)),
            (half_y * (forth_uy - back_uy), half_y * (forth_vy - back_vy)),
            rise,
            (1.0, 0.0, 1.0),
        )
        decrease = bed.steepness[c] * math.sqrt(h_i) if wet else 0.0
        b_x, b_y, b_xy, wave_x, wave_y = pressure_along_axes(
            axes, along, across, decrease, normal, rise, material
        )
        status.beta_x[i], status.beta_y[i], shear[i] = b_x, b_y, b_xy
        this = (abs(u_i) + wave_speed(wave_x, b_x, h_i)) * over_x
        this += (abs(v_i) + wave_speed(wave_y, b_y, h_i)) * over_y
        this = raised_by_fall(this, abs(u_i) * over_x + abs(v_i) * over_y, bed.falling[c])
        this = raised_rate(law_at(material.law, i), this, h_i, normal, dry)
        this = this if may_flow(h_i, u_i, v_i, dry) else 0.0
        rate[c] = this if this > rate[c] else rate[c]


@kernel()
def hold_along_flow(
    shear: Array | None,
    now: Fields,
    status: Status,
    bed: Bed,
    material: Material,
    grid: Grid,
    cell: int,
    column: int,
    count: int,
) -> None:
    """Say which cells of a run are below yield, as `classify_run` does without what pressure shears.

    At a face the slope in the other direction, the mean one, drives as well.
    """
    if shear is None:
        return
    h, u, v = now
    dry, one, row = material.dry, np.uint64(1), np.uint64(grid.stride)
    over_x, over_y = 1.0 / grid.dx, 1.0 / grid.dy
    for k in range(count):
        i, c = np.uint64(cell) + np.uint64(k), np.uint64(column) + np.uint64(k)
        if u[i] != 0.0 or v[i] != 0.0 or h[i] <= dry:
            continue
        w, e, s, n = i - one, i + one, i - row, i + row
        b_x, b_y, b_xy = status.beta_x[i], status.beta_y[i], shear[i]
        pull, normal, law = bed.along[c], bed.normal[c], law_at(material.law, i)
        back_x, forth_x = (h[i] - h[w]) * over_x, (h[e] - h[i]) * over_x
        back_y, forth_y = (h[i] - h[s]) * over_y, (h[n] - h[i]) * over_y
        mean_x, mean_y = 0.5 * (back_x + forth_x), 0.5 * (back_y + forth_y)
        rests = True
        for r_x, r_y, beyond in (
            (back_x, mean_y, h[w]),
            (forth_x, mean_y, h[e]),
            (mean_x, back_y, h[s]),
            (mean_x, forth_y, h[n]),
        ):
            drive_x, drive_y = b_x * r_x + b_xy * r_y - pull, b_xy * r_x + b_y * r_y
            rests &= below_yield(law, drive_x, drive_y, 0.5 * (h[i] + beyond), normal)
        status.static[i] = BELOW_YIELD if rests else 0.0


@kernel()
def classify(
    now: Fields, status: Status, bed: Bed, material: Material, sides: Sides, grid: Grid, spans: Spans
) -> float:
    """Set the status of every cell that may be wet, trim the wet spans, find the moving ones.

    Returns
    -------
    float
        Largest ``(|u| + c_x)/dx + (|v| + c_y)/dy`` of a wet cell, or what gravity needs there, s-1.
    """
    m, static = grid.stride, status.static
    south, north = GHOSTS * ONE, grid.rows - GHOSTS - 1
    fill_ghosts(now, status.beta_x, status.beta_y, sides, grid, spans.wet, south, north)
    spans.rate[:] = 0.0
    for j in range(GHOSTS, grid.rows - GHOSTS):
        lo, hi = spans.wet[0, j], spans.wet[1, j]
        spans.moving[0, j] = spans.moving[1, j] = 0
        if lo >= hi:
            continue
        bound_films(now, material.dry, m, j * m + lo, hi - lo)
        classify_run(now, status, bed, material, grid, spans.rate, j * m + lo, lo, hi - lo)
        if lo == GHOSTS:
            copy_status(status, j * m + lo - 1, j * m + lo, ONE)
        if hi == m - GHOSTS:
            copy_status(status, j * m + hi, j * m + hi - 1, ONE)
        if j == GHOSTS + (1 if sides.kind[2] == AXIS else 0):
            copy_status(status, (GHOSTS - 1) * m + lo, j * m + lo, hi - lo)
        if j == grid.rows - GHOSTS - 1:
            copy_status(status, (j + 1) * m + lo, j * m + lo, hi - lo)
        trim(spans, j, static, j * m)
    rate: float = driven_rate(now.h, status, bed, material, sides, grid)
    for c in range(m):
        rate = max(rate, spans.rate[c])
    return rate


@kernel(unaliased=True)
def copy_status(status: Status, ghost: int, source: int, count: int) -> None:
    """Give a run of ghosts, from index ``ghost`` on, the status of their images, from index ``source`` on."""
    for k in range(count):
        g, i = np.uint64(ghost) + np.uint64(k), np.uint64(source) + np.uint64(k)
        status.beta_x[g], status.beta_y[g] = status.beta_x[i], status.beta_y[i]
        status.static[g] = status.static[i]


@kernel()
def driven_rate(h: Array, status: Status, bed: Bed, material: Material, sides: Sides, grid: Grid) -> float:
    """Let given depths drive the ghosts beside them; return the largest wave rate of those, s-1."""
    m, rate = grid.stride, 0.0
    for k in range(4):
        if sides.kind[k] != DEPTH:
            continue
        along_x = k < 2
        count = grid.rows - 2 * GHOSTS if along_x else m - 2 * GHOSTS
        for n in range(GHOSTS, GHOSTS + count):
            row = n if along_x else (GHOSTS if k == 2 else grid.rows - GHOSTS - 1)
            column = n if not along_x else (GHOSTS if k == 0 else m - GHOSTS - 1)
            step = (1 if k % 2 == 1 else -1) * (1 if along_x else m)
            cell, ghost = row * m + column, row * m + column + step
            copy_status(status, ghost, cell, ONE)
            beta = status.beta_x[cell] if along_x else status.beta_y[cell]
            d, pull = (grid.dx, step * bed.along[column]) if along_x else (grid.dy, 0.0)
            if h[ghost] <= material.dry:
                continue
            drive = beta * (h[ghost] - h[cell]) / d - pull
            status.static[ghost], speed = status_at_depth(
                status.static[ghost],
                h[ghost],
                h[cell],
                drive,
                beta,
                bed.normal[column],
                law_at(material.law, cell),
            )
            # what it sends into a dry cell falls there from now on
            rate = max(rate, speed / d, bed.falling[column] if speed > 0.0 else 0.0)
    return rate
