"""The weighted-residual (conservative) form of LMLS on a cloud: Voronoi faces, LMLS gradients, HLL.

The scheme of `solver.weighted_residual` on cells of any shape: testing eq. 12 with the indicator function of
a control volume gives ``V dU/dt = - sum over faces of (length F*) + V S``. What is the state behind a cell on
a lattice is read off the LMLS gradient at the cell here; where that is the central difference, on a lattice
with supports of five, both schemes are the same.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.activity import Material, Status
from solver.boundary import NO_SLIP, OPEN, WALL, Fields, Sides
from solver.cell_update import braked, dragged
from solver.cloud_activity import CloudBed, Gradient, Stepped
from solver.cloud_faces import (
    CHUNK,
    Faces,
    Gathered,
    fill_ghosts_beyond_faces,
    gather,
    reconstruct,
    slopes_at,
)
from solver.compiled import Array, Indices, kernel
from solver.reconstruction import FaceValues
from solver.riemann import Fluxes, hll
from solver.weighted_residual import SPARE, whole


class CloudBuffers(NamedTuple):
    """Scratch arrays.

    slopes : (cells, 8), as `slopes_at` fills them; ghosts keep zeros and no bounds of depth.
    fluxes : (f, 4), of mass (m2 s-1) and of momentum along and across (m3 s-2), and the mean of h^2/2 (m2).
    loss, keep : (cells,), volume that leaves a cell per time, m3 s-1, and the share of it that it can afford.
    gathered, low, high, still, chunk : of a chunk of faces.
    """

    slopes: Array
    fluxes: Array
    loss: Array
    keep: Array
    gathered: Gathered
    low: FaceValues
    high: FaceValues
    still: Array
    chunk: Fluxes


def cloud_buffers(cells: int, ghosts: int, faces: int) -> CloudBuffers:
    """Make the scratch arrays for a number of cells, ghosts and faces."""
    slopes = np.zeros((cells + ghosts, 8))
    slopes[cells:, 7] = np.inf
    return CloudBuffers(
        slopes,
        np.zeros((faces, 4)),
        np.zeros(cells + ghosts),
        np.ones(cells + ghosts),
        Gathered(*np.zeros((len(Gathered._fields), 2, CHUNK))),
        FaceValues(*np.zeros((7, CHUNK))),
        FaceValues(*np.zeros((7, CHUNK))),
        np.zeros(2 * CHUNK),
        Fluxes(*np.zeros((4, CHUNK))),
    )


@kernel()
def fluxes_through(
    now: Fields,
    status: Status,
    chosen: Indices,
    faces: Faces,
    sides: Sides,
    dry: float,
    buffers: CloudBuffers,
) -> None:
    """HLL fluxes through faces, in the frame of the domain; what they take from a cell adds to its loss."""
    low, high, still, chunk = buffers.low, buffers.high, buffers.still, buffers.chunk
    geometry, fluxes, loss = faces.geometry, buffers.fluxes, buffers.loss
    for start in range(0, len(chosen), CHUNK):
        count = min(CHUNK, len(chosen) - start)
        gather(now, buffers.slopes, faces, chosen, start, count, dry, buffers.gathered)
        reconstruct(buffers.gathered, 0, whole(count), dry, low.h_high, low.n_high, low.t_high)
        reconstruct(buffers.gathered, 1, whole(count), dry, high.h_low, high.n_low, high.t_low)
        for k in range(count):
            k_ = np.uint64(k)
            f = np.uint64(chosen[np.uint64(start) + k_])
            i, j = np.uint64(faces.left[f]), np.uint64(faces.right[f])
            x_share = geometry[f, 0] * geometry[f, 0]
            y_share = geometry[f, 1] * geometry[f, 1]
            low.c[k_] = math.sqrt((status.beta_x[i] * x_share + status.beta_y[i] * y_share) * now.h[i])
            high.c[k_] = math.sqrt((status.beta_x[j] * x_share + status.beta_y[j] * y_share) * now.h[j])
            still[k_], still[np.uint64(CHUNK) + k_] = status.still[i], status.still[j]
        bounded = chosen[start + count - 1] >= faces.inner
        if bounded:
            for k in range(count):
                side = faces.side[chosen[start + k]]
                if side >= 0 and (sides.kind[side] == WALL or sides.kind[side] == NO_SLIP):
                    high.h_low[k], high.n_low[k] = low.h_high[k], -low.n_high[k]
                    high.t_low[k] = low.t_high[k] if sides.kind[side] == WALL else -low.t_high[k]
        hll(low, 0, high, 0, still, 0, CHUNK, whole(count), dry, chunk, 0)
        if bounded:
            restrict_faces(buffers.gathered, low.c, chosen, start, count, faces, sides, chunk)
        for k in range(count):
            k_ = np.uint64(k)
            f = np.uint64(chosen[np.uint64(start) + k_])
            n_x, n_y, mass = geometry[f, 0], geometry[f, 1], chunk.mass[k_]
            fluxes[f, 0], fluxes[f, 3] = mass, chunk.pressure[k_]
            fluxes[f, 1] = n_x * chunk.normal[k_] - n_y * chunk.tangential[k_]
            fluxes[f, 2] = n_y * chunk.normal[k_] + n_x * chunk.tangential[k_]
            taken = mass * geometry[f, 10]
            loss[np.uint64(faces.left[f])] += taken if taken > 0.0 else 0.0
            loss[np.uint64(faces.right[f])] -= taken if taken < 0.0 else 0.0


@kernel()
def restrict_faces(
    values: Gathered,
    c: Array,
    chosen: Indices,
    start: int,
    count: int,
    faces: Faces,
    sides: Sides,
    chunk: Fluxes,
) -> None:
    """Impose on boundary faces what their side allows, as `solver.boundary.restrict`."""
    for k in range(count):
        side = faces.side[chosen[start + k]]
        if side < 0:
            continue
        if sides.kind[side] == OPEN and chunk.mass[k] < 0.0:
            chunk.mass[k] = chunk.normal[k] = chunk.tangential[k] = 0.0
        elif sides.kind[side] == WALL:
            chunk.mass[k] = chunk.tangential[k] = 0.0
        elif sides.kind[side] == NO_SLIP:
            h, chunk.mass[k] = values.h[0, k], 0.0
            chunk.tangential[k] = (abs(values.n[0, k]) + c[k]) * h * values.t[0, k]


@kernel()
def cloud_stage(
    start: Fields,
    now: Fields,
    out: Fields,
    status: Status,
    bed: CloudBed,
    material: Material,
    sides: Sides,
    area: Array,
    faces: Faces,
    gradient: Gradient,
    stepped: Stepped,
    part: float,
    share: float,
    dt: float,
    buffers: CloudBuffers,
    ledger: Array,
    sloped: bool,
) -> None:
    """One Runge-Kutta stage, as `solver.weighted_residual.stage`.

    Parameters
    ----------
    area : (n,) array
        Of the control volumes, m2.
    sloped : bool
        Whether the slopes of ``now`` are there already.
    """
    dry = material.dry
    fluxes, loss, keep = buffers.fluxes, buffers.loss, buffers.keep
    if not sloped:
        fill_ghosts_beyond_faces(now, status.beta_x, faces, sides)
        slopes_at(
            now, stepped.sloped, gradient.neighbours, gradient.along, gradient.across, dry, buffers.slopes
        )
    loss[:] = 0.0
    fluxes_through(now, status, stepped.faces, faces, sides, dry, buffers)
    short = 0
    for k in range(len(stepped.cells)):
        i = np.uint64(stepped.cells[np.uint64(k)])
        lost, most = loss[i] * (dt / area[i]), (1.0 - SPARE) * now.h[i]
        keep[i] = most / lost if lost > most else 1.0
        short |= 1 if lost > most else 0
    if short:
        for k in range(len(stepped.faces)):
            f = stepped.faces[k]
            giver = faces.left[f] if fluxes[f, 0] > 0.0 else faces.right[f]
            for q in range(3):
                fluxes[f, q] *= keep[giver]
    for k in range(len(stepped.faces) - 1, -1, -1):
        f = stepped.faces[k]
        if f < faces.inner:
            break
        leaving = fluxes[f, 0] * faces.geometry[f, 10] * share * dt
        if leaving > 0.0:
            ledger[faces.side[f], 1] += leaving
        else:
            ledger[faces.side[f], 0] -= leaving
    update_cells(stepped.cells, start, now, out, status, bed, material, area, faces, part, dt, fluxes)


@kernel()
def update_cells(
    chosen: Indices,
    start: Fields,
    now: Fields,
    out: Fields,
    status: Status,
    bed: CloudBed,
    material: Material,
    area: Array,
    faces: Faces,
    part: float,
    dt: float,
    fluxes: Array,
) -> None:
    """Update cells from their faces, then apply friction, as `solver.weighted_residual.update_row`."""
    dry, braking = material.dry, part * dt * material.tangent
    spoke = faces.spoke
    for k in range(len(chosen)):
        i = np.uint64(chosen[np.uint64(k)])
        gain = gain_u = gain_v = push_x = push_y = 0.0
        for m in range(faces.first[i], faces.first[i + np.uint64(1)]):
            m_ = np.uint64(m)
            f, length = np.uint64(faces.face[m_]), spoke[m_, 0]
            gain += length * fluxes[f, 0]
            gain_u += length * fluxes[f, 1]
            gain_v += length * fluxes[f, 2]
            push_x += spoke[m_, 1] * fluxes[f, 3]
            push_y += spoke[m_, 2] * fluxes[f, 3]
        over = 1.0 / area[i]
        h_0, h_1 = start.h[i], now.h[i]
        free = 1.0 - (status.still[i] if h_0 > dry else 0.0)
        gain *= over
        gain_u = gain_u * over + free * (status.beta_x[i] * push_x * over + bed.along[i] * h_1)
        gain_v = gain_v * over + free * (status.beta_y[i] * push_y * over)
        hu, hv = h_0 * start.u[i], h_0 * start.v[i]
        h = h_0 + part * ((h_1 - h_0) + dt * gain)
        hu += part * ((h_1 * now.u[i] - hu) + dt * gain_u)
        hv += part * ((h_1 * now.v[i] - hv) + dt * gain_v)
        per_depth = braked(hu, hv, h, now.u[i], h_1, bed.normal[i], bed.curvature[i], braking, dry)
        u, v = hu * per_depth, hv * per_depth
        slowed = (
            dragged(math.sqrt(u * u + v * v), h, part * dt * material.drag) if material.drag > 0.0 else 1.0
        )
        out.h[i], out.u[i], out.v[i] = h, u * slowed, v * slowed
