"""What the cells of a cloud are in a step: earth pressure, static or not, and how fast waves leave them."""

from __future__ import annotations

import math

import numpy as np

from solver.arrays import Array, Indices
from solver.cloud.arrays import CloudArrays
from solver.cloud.faces import Faces, beyond, fill_ghosts_beyond, half_of
from solver.cloud.flow_axes import Ways, axes_at, strain_along_flow
from solver.cloud.on_surface import in_frame, pull_across, way_in_frame
from solver.cloud.reconstruction import find_most_slower, flatten_fed, slopes_at, strain_at
from solver.cloud.sections import forget_above
from solver.compiled import kernel
from solver.kernels.boundary import status_at_depth
from solver.kernels.earth_pressure import earth_pressure, wave_speed
from solver.kernels.flow_axes import normal_pressure, pressure_along_axes, sheared
from solver.kernels.friction import below_yield, law_at, raised_rate
from solver.kernels.runge_kutta import raised_by_fall
from solver.kernels.state import (
    BELOW_YIELD,
    DEPTH,
    DRY,
    LANES,
    NO_SLIP,
    WALL,
    CloudBed,
    Fields,
    Material,
    Sides,
    Status,
    may_flow,
    share_of_speed,
    square_above,
)
from solver.points.voronoi import ControlVolumes

# Gradients of velocity this much below speed per spacing are round-off, and count as none.
TIE = 1e-10
# A cell may be this much smaller than those around it before it shortens the step.
SMALL = 1.25


def widths_of(volumes: ControlVolumes, faces: Faces) -> Array:
    """Measure cells for the rate of the waves that leave them, (5, cells).

    Half the sum over the faces of length times speed, per area: along x (0) and y (1), m-1, and for a speed
    of 1 in every direction (2), m-1; and the means around the cell, weighted by length, of n_x^2 (3) and
    n_x n_y (4). The first three are means over a cell and its neighbours, since it takes more than one cell
    for a disturbance to grow, but at least 1/SMALL of the cell's own.
    """
    cell = np.concatenate([volumes.left, volumes.right, volumes.side_cell])
    half = np.concatenate([volumes.length, volumes.length, volumes.side_length]) / 2
    normals = np.concatenate([volumes.normal, volumes.normal, volumes.side_normal]).T
    return widths_between(volumes, volumes.area, cell, half, normals, faces.cells)


def widths_between(
    volumes: ControlVolumes, area: Array, cell: Indices, half: Array, normals: Array, cells: int
) -> Array:
    """Measure cells as `widths_of` does, by their faces as they have them.

    Parameters
    ----------
    area : (n,) array
        Of the cells, m2.
    cell, half : (k,) array
        Cell of each side of a face, first those on the left, and half the length of the face, m.
    normals : (2, k) array
        Of the faces, in the frames of the cells.
    cells : int
        Number of cells to fill up to.
    """
    n, (n_x, n_y) = len(area), normals
    means = [
        np.bincount(cell, half * a, n) for a in (abs(n_x), abs(n_y), np.ones(len(half)), n_x**2, n_x * n_y)
    ]
    # a cell of a building has no face
    around = np.where(means[2] > 0.0, means[2], 1.0)
    widths = np.stack([*(a / area for a in means[:3]), *(a / around for a in means[3:])])
    near = np.concatenate([np.arange(n), volumes.left, volumes.right])
    seen = np.concatenate([np.arange(n), volumes.right, volumes.left])
    for own in widths[:3]:
        own[:] = np.maximum(own / SMALL, np.bincount(near, own[seen], n) / np.bincount(near, minlength=n))
    return np.pad(widths, ((0, 0), (0, cells - n)))


@kernel(inline=True)
def mean_pressure(shear: Array | None, i: int, b_x: float, b_y: float, m_x: float, m_xy: float) -> float:
    """Pressure of cell i on its faces in the mean, by their mean n_x^2 and n_x n_y, m s-2."""
    mean = m_x * b_x + (1.0 - m_x) * b_y
    if shear is not None:
        mean += 2.0 * m_xy * shear[i]
    return mean


@kernel(inline=True)
def pressure_at(
    shear: Array | None,
    now: Fields,
    slopes: Array,
    bed: CloudBed,
    material: Material,
    rates: tuple[float, float],
    decrease: float,
    i: int,
) -> tuple[float, float, float, float]:
    """Earth pressure of cell i by the rates of stretching, as `earth_pressure`; fills ``beta_xy``."""
    normal, (along, across) = bed.normal[i], rates
    if shear is None:
        b_x, b_y, wave_x, wave_y = earth_pressure(
            along, across, decrease, normal, abs(slopes[0, i]), abs(slopes[1, i]), material
        )
        return b_x, b_y, wave_x, wave_y
    axes = axes_at(now, slopes, bed, material.dry, i)
    rise = in_frame(bed.lift, i, slopes[0, i], slopes[1, i])
    b_x, b_y, shear[i], wave_x, wave_y = pressure_along_axes(
        axes, along, across, decrease, normal, rise, material
    )
    return b_x, b_y, wave_x, wave_y


@kernel(unaliased=True)
def set_status(
    now: Fields,
    slopes: Array,
    status: Status,
    bed: CloudBed,
    material: Material,
    widths: Array,
    start: int,
    stop: int,
    rate: Array,
) -> None:
    """Set the earth pressure of a run of cells, which are dry, and the rate of the waves that leave them.

    Parameters
    ----------
    slopes
        From `slopes_at`, and `strain_at` where the state matters.
    widths
        From `widths_of`.
    start, stop
        The cells.
    rate
        (cells,) array, filled, s-1.
    """
    steepness = material.transition[1]
    for k in range(start, stop):
        i = np.uint64(k)
        h, u, v = now.h[i], now.u[i], now.v[i]
        normal, wet = bed.normal[i], h > material.dry
        w_x, w_y, around, m_x, m_xy = widths[0, i], widths[1, i], widths[2, i], widths[3, i], widths[4, i]
        tie = TIE * around * (abs(u) + abs(v) + math.sqrt(normal * h))
        u_x, v_y = slopes[6, i], slopes[7, i]
        b_x, b_y, wave_x, wave_y = pressure_at(
            status.beta_xy,
            now,
            slopes,
            bed,
            material,
            (u_x if abs(u_x) > tie else 0.0, v_y if abs(v_y) > tie else 0.0),
            steepness * math.sqrt(h / normal) if wet else 0.0,
            i,
        )
        status.beta_x[i], status.beta_y[i] = b_x, b_y
        may = may_flow(h, u, v, material.dry)
        status.static[i] = 0.0 if may else DRY
        # around is 0 where there is no cell
        wave = (w_x * wave_x + w_y * wave_y) / (around + 1e-300)
        b_mean = mean_pressure(status.beta_xy, i, b_x, b_y, m_x, m_xy)
        waves = around * wave_speed(wave, b_mean, h)
        square = m_x * (u * u) + (1.0 - m_x) * (v * v) + 2.0 * m_xy * (u * v)
        mean, most = around * math.sqrt(square if square > 0.0 else 0.0), w_x * abs(u) + w_y * abs(v)
        carried = mean if mean < most else most
        leaving = raised_by_fall(carried + waves, carried, bed.falling[i])
        leaving = raised_rate(law_at(material.law, i), leaving, h, normal, material.dry)
        rate[i] = leaving if may else 0.0


@kernel()
def bound_films(arrays: CloudArrays, start: int, stop: int) -> None:
    """Bound the speed of the dry cells of a run by that of deeper ones beside them, as on a lattice."""
    now, faces, dry = arrays.now, arrays.faces, arrays.material.dry
    for i in range(start, stop):
        if now.h[i] > dry or (now.u[i] == 0.0 and now.v[i] == 0.0):
            continue
        most = 0.0
        for m in range(faces.number[i]):
            _, j, _ = beyond(faces, half_of(faces, i, m))
            most = max(most, square_above(now.h[j], now.u[j], now.v[j], dry))
        share = share_of_speed(now.u[i], now.v[i], most)
        u, v = share * now.u[i], share * now.v[i]
        for state in (now, arrays.first_stage, arrays.second_stage):
            state.u[i], state.v[i] = u, v


@kernel()
def is_static(
    now: Fields,
    slopes: Array,
    status: Status,
    bed: CloudBed,
    material: Material,
    sides: Sides,
    faces: Faces,
    i: int,
) -> bool:
    """Whether cell i, which is at rest, is below yield.

    It is if ``|(beta_x h_x - g sin xi, beta_y h_y)|`` is at most ``R(0, h)`` at each face, with
    the difference to the cell beyond and the gradient along the face. A wall supports what presses on it.
    From a dry cell nothing can slide in: what supports the rim of a heap lies below it.
    """
    h, b_x, b_y = now.h, status.beta_x[i], status.beta_y[i]
    for m in range(faces.number[i]):
        f, j, sign = beyond(faces, half_of(faces, i, m))
        if f >= faces.outer and sides.kind[faces.side[f - faces.outer]] in (WALL, NO_SLIP):
            continue
        d_x, d_y = sign * faces.geometry[2, f], sign * faces.geometry[3, f]
        more = (h[j] - h[i] - slopes[0, i] * d_x - slopes[1, i] * d_y) / (d_x * d_x + d_y * d_y)
        rise_x, rise_y = in_frame(bed.lift, i, slopes[0, i] + more * d_x, slopes[1, i] + more * d_y)
        d_x, d_y = way_in_frame(bed.lift, i, d_x, d_y)
        more_x, more_y = sheared(status.beta_xy, i, rise_x, rise_y)
        pull_x = b_x * rise_x + more_x - bed.along[i]
        pull_y = b_y * rise_y + more_y - pull_across(bed.lift, i)
        if h[j] <= material.dry and pull_x * d_x + pull_y * d_y >= 0.0:
            continue
        if not below_yield(law_at(material.law, i), pull_x, pull_y, 0.5 * (h[i] + h[j]), bed.normal[i]):
            return False
    return True


@kernel()
def classify_ghosts(
    now: Fields,
    status: Status,
    bed: CloudBed,
    material: Material,
    sides: Sides,
    faces: Faces,
    area: Array,
    start: int,
    stop: int,
) -> float:
    """Give some ghosts the status of their cells, but let a given depth drive them; return its wave rate."""
    h, fastest = now.h, 0.0
    for b in range(start, stop):
        f = faces.outer + b
        i, ghost = int(faces.left[f]), int(faces.right[f])
        b_x, b_y = status.beta_x[i], status.beta_y[i]
        status.beta_x[ghost], status.beta_y[ghost], status.static[ghost] = b_x, b_y, status.static[i]
        if sides.kind[faces.side[b]] == DEPTH and h[ghost] > material.dry:
            n_x, n_y = faces.geometry[0, f], faces.geometry[1, f]
            way = faces.geometry[2, f] * n_x + faces.geometry[3, f] * n_y
            b_n = normal_pressure(status.beta_xy, i, b_x, b_y, n_x, n_y)
            drive = b_n * (h[ghost] - h[i]) / way - n_x * bed.along[i]
            status.static[ghost], speed = status_at_depth(
                status.static[ghost], h[ghost], h[i], drive, b_n, bed.normal[i], law_at(material.law, i)
            )
            # what it sends into a dry cell falls there from now on
            falling = bed.falling[i] if speed > 0.0 else 0.0
            fastest = max(fastest, speed * faces.geometry[6, f] / area[i], falling)
    return fastest


@kernel()
def find_strain(ways: Ways | None, arrays: CloudArrays, start: int, stop: int) -> None:
    """Find how a run of cells is strained, along x and y or along the axes of the flow."""
    now, gradient, strain, slopes = arrays.now, arrays.gradient, arrays.strain, arrays.buffers.slopes
    if ways is None:
        strain_at(now, gradient.neighbours, strain, start, stop, arrays.material.dry, slopes)
    else:
        about = arrays.bed, arrays.material
        strain_along_flow(now, gradient, strain, ways, *about, start, stop, slopes)


@kernel()
def classify_cloud(arrays: CloudArrays) -> float:
    """Set slopes and status where something has changed: in the sloped runs of the step before.

    Returns
    -------
    float
        Largest wave rate of a wet cell, s-1, wherever it is.
    """
    now, status, bed, material, sides = arrays.now, arrays.status, arrays.bed, arrays.material, arrays.sides
    faces, activity, slopes, rate = arrays.faces, arrays.activity, arrays.buffers.slopes, arrays.buffers.rate
    u, v, static, top = now.u, now.v, status.static, activity.top
    fastest = 0.0
    for r in range(activity.counts[2]):
        start, stop = activity.sloped_runs[r]
        first, last = faces.first_side[start // LANES], faces.first_side[stop // LANES]
        fill_ghosts_beyond(now, status, faces, sides, first, last)
        bound_films(arrays, start, stop)
        slopes_at(now, arrays.gradient, start, stop, material.dry, slopes)
        find_most_slower(now, bed.normal, start, stop, slopes)
        forget_above(now, arrays.gradient, arrays.doors, start, stop, material.dry, slopes)
        if material.transition[1] > 0.0:
            find_strain(arrays.ways, arrays, start, stop)
        flatten_fed(slopes, faces, sides, first, last)
        set_status(now, slopes, status, bed, material, arrays.widths, start, stop, rate)
        for b in range(start // LANES, stop // LANES):
            moves, top[b] = False, 0.0
            for i in range(b * LANES, (b + 1) * LANES):
                top[b] = max(top[b], rate[i])
                rests = static[i] == 0.0 and u[i] == 0.0 and v[i] == 0.0
                if rests and is_static(now, slopes, status, bed, material, sides, faces, i):
                    static[i] = BELOW_YIELD
                moves |= static[i] == 0.0
            activity.moving[b] = moves
        fastest = max(
            fastest, classify_ghosts(now, status, bed, material, sides, faces, arrays.area, first, last)
        )
    for b in range(len(top)):
        fastest = max(fastest, top[b])
    return fastest
