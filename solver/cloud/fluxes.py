"""What passes the faces of a cloud: chunks of faces, reconstructed from both sides, through HLL."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solver.arrays import Array
from solver.cloud.faces import Faces, all_aligned, normal_beyond, whole_blocks
from solver.cloud.reconstruction import face_states
from solver.compiled import ONE, ZERO, kernel
from solver.kernels.boundary import boundary_flux
from solver.kernels.riemann import hll
from solver.kernels.state import LANES, NO_SLIP, WALL, FaceValues, Fields, Fluxes, Sides, Status, whole

# Faces taken at a time: what passes between the loops over them stays in the nearest caches.
CHUNK = 256


class CloudBuffers(NamedTuple):
    """Scratch arrays.

    Attributes
    ----------
    slopes
        (9, cells and ghosts), as `slopes_at` and `strain_at` fill them; ghosts keep zeros.
    halves
        (3, 2 faces and LANES), what passes each half-face into its cell: volume, m3 s-1, and momentum along x
        and y with the pressure times the cell's own beta, m4 s-2.
    pressed
        (faces,), of the HLL mean of h^2/2, m2.
    gain
        (4, cells), sums of the three around each cell, and the volume that leaves it, m3 s-1.
    rate
        (cells,), of the waves that leave each cell, s-1.
    limited
        (blocks,), flags.
    low, high, static, push, chunk
        Of the faces of a chunk, as `face_states` and `hll` fill them.
    """

    slopes: Array
    halves: Array
    pressed: Array
    gain: Array
    rate: Array
    limited: Array
    low: FaceValues
    high: FaceValues
    static: Array
    push: Array
    chunk: Fluxes


def cloud_buffers(faces: Faces) -> CloudBuffers:
    """Make the scratch arrays."""
    buffers = CloudBuffers(
        np.zeros((9, faces.cells + whole_blocks(len(faces.side)) + LANES)),
        np.zeros((3, 2 * faces.faces + LANES)),
        np.zeros(faces.faces),
        np.zeros((4, faces.cells)),
        np.zeros(faces.cells),
        np.zeros(faces.cells // LANES),
        FaceValues(*(np.zeros(CHUNK) for _ in range(7))),
        FaceValues(*(np.zeros(CHUNK) for _ in range(7))),
        np.zeros(2 * CHUNK),
        np.zeros((4, CHUNK)),
        Fluxes(*(np.zeros(CHUNK) for _ in range(4))),
    )
    return all_aligned(buffers)


@kernel(unaliased=True)
def halve(
    geometry: Array,
    far: Array | None,
    mass: Array,
    normal: Array,
    tangential: Array,
    pressure: Array,
    push: Array,
    start: int,
    count: int,
    halves: Array,
    pressed: Array,
) -> None:
    """Give what passes a run of faces to their halves, in the frame of the domain or of their cells.

    Parameters
    ----------
    far
        Of `Faces`.
    mass, normal, tangential, pressure, push : (chunk,) and (4, chunk) arrays
        Fluxes of the faces, as of `Fluxes`, and what `face_states` fills.
    start, count : int
        First face, and number of faces.
    halves, pressed : arrays
        Of `CloudBuffers`, filled.
    """
    g = geometry
    stride = np.uint64(len(pressed))
    for k in range(count):
        k_ = np.uint64(k)
        f = np.uint64(start) + k_
        other = stride + f
        l_x, l_y, p = g[6, f] * g[0, f], g[6, f] * g[1, f], pressure[k_]
        x, y = l_x * normal[k_] - l_y * tangential[k_], l_y * normal[k_] + l_x * tangential[k_]
        m_x, m_y = normal_beyond(far, f, g[0, f], g[1, f])
        r_x, r_y = g[6, f] * m_x, g[6, f] * m_y
        x_r, y_r = r_x * normal[k_] - r_y * tangential[k_], r_y * normal[k_] + r_x * tangential[k_]
        volume = g[6, f] * mass[k_]
        pressed[f] = p
        halves[0, f], halves[0, other] = -volume, volume
        halves[1, f], halves[1, other] = -x - push[0, k_] * p, x_r + push[2, k_] * p
        halves[2, f], halves[2, other] = -y - push[1, k_] * p, y_r + push[3, k_] * p


@kernel()
def fluxes_through(
    now: Fields,
    status: Status,
    faces: Faces,
    sides: Sides,
    dry: float,
    buffers: CloudBuffers,
    first: int,
    last: int,
) -> None:
    """HLL fluxes through a run of faces, all of them inner faces or none.

    Parameters
    ----------
    dry : float
        Depth up to which a cell counts as dry, m.
    first, last : int
        First face, and the one after the last.
    """
    # taken out of their tuples once: each time counts references to all arrays in them
    low, high, static, push, chunk = buffers.low, buffers.high, buffers.static, buffers.push, buffers.chunk
    _, h_low, _, n_low, _, t_low, c_low = low
    h_high, _, n_high, _, t_high, _, c_high = high
    mass, normal, tangential, pressure = chunk
    left, right, geometry = faces.left, faces.right, faces.geometry
    slopes, halves, pressed = buffers.slopes, buffers.halves, buffers.pressed
    outer = first >= faces.outer
    # from the beginning of a line of the cache: what is done again below the first comes out the same
    for start in range(first // LANES * LANES, last, CHUNK):
        count = min(CHUNK, last - start)
        lanes = whole(count)
        face_states(
            now,
            slopes,
            status,
            left,
            right,
            geometry,
            faces.far,
            start,
            lanes,
            dry,
            h_low,
            n_low,
            t_low,
            c_low,
            h_high,
            n_high,
            t_high,
            c_high,
            static,
            push,
        )
        if outer:
            mirror_at_walls(faces, sides, start, count, low, high)
        hll(low, ZERO, high, ZERO, static, ZERO, CHUNK * ONE, lanes, dry, chunk, ZERO)
        if outer:
            restrict_at_sides(now, faces, sides, start, count, low.c, chunk)
        halve(geometry, faces.far, mass, normal, tangential, pressure, push, start, lanes, halves, pressed)


@kernel()
def mirror_at_walls(
    faces: Faces, sides: Sides, start: int, count: int, low: FaceValues, high: FaceValues
) -> None:
    """Put the mirror image of the state before a wall beyond it."""
    for k in range(count):
        kind = sides.kind[faces.side[start + k - faces.outer]]
        if kind in (WALL, NO_SLIP):
            high.h_low[k], high.n_low[k], high.c[k] = low.h_high[k], -low.n_high[k], low.c[k]
            high.t_low[k] = low.t_high[k] if kind == WALL else -low.t_high[k]


@kernel()
def restrict_at_sides(
    now: Fields, faces: Faces, sides: Sides, start: int, count: int, c: Array, chunk: Fluxes
) -> None:
    """Impose on boundary faces what their side allows, as `solver.kernels.boundary.boundary_flux`."""
    for k in range(count):
        f = start + k
        kind, i = sides.kind[faces.side[f - faces.outer]], int(faces.left[f])
        n_x, n_y = faces.geometry[0, f], faces.geometry[1, f]
        n, t = n_x * now.u[i] + n_y * now.v[i], n_x * now.v[i] - n_y * now.u[i]
        flux = chunk.mass[k], chunk.normal[k], chunk.tangential[k]
        chunk.mass[k], chunk.normal[k], chunk.tangential[k] = boundary_flux(
            flux, kind, 1.0, now.h[i], n, t, c[k]
        )
