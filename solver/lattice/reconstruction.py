"""Values at the two sides of every face: the LMLS reconstruction on a lattice, limited."""

from __future__ import annotations

import math

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.limiter import (
    AHEAD,
    BEHIND,
    at_rear,
    face_state,
    largest_step,
    lead,
    least_shown,
    limited,
    rear_step,
    slips,
    steepness_of,
)
from solver.kernels.state import FaceValues


@kernel(inline=True)
def steps_to_faces(back: float, forth: float, steepness: float) -> tuple[float, float]:
    """Limited steps along the direction from a cell's mean to its low and high face (eq. 23).

    Parameters
    ----------
    back, forth : float
        Differences from the neighbour behind and to the one ahead.
    steepness : float
        As of `solver.kernels.limiter.largest_step`.
    """
    b, f, most = abs(back), abs(forth), largest_step(back, forth, steepness)
    return -limited(AHEAD * b - BEHIND * f, most, back), limited(-BEHIND * b + AHEAD * f, most, forth)


@kernel(unaliased=True, inline=True)
def face_values(
    h: Array,
    n: Array,
    t: Array,
    beta: Array,
    cell: int,
    neighbour: int,
    count: int,
    dry: float,
    out: FaceValues,
    to: int,
) -> None:
    """Reconstruct a run of cells at their low and high faces along one direction.

    A dry neighbour has no velocity to differ by: toward it a velocity is the mean. `solver.kernels.limiter`
    bounds the values.

    Parameters
    ----------
    h, n, t : flat arrays
        Depth (m), velocity along the direction and across it (m s-1).
    beta : flat array
        g cos(xi) K in the direction (eq. 7), m s-2.
    cell, count : int
        Index of the first cell, and number of cells.
    neighbour : int
        Distance in memory to the neighbour ahead: 1 along x, the row length along y.
    dry : float
        Depth up to which a cell counts as dry, m.
    out : FaceValues
        Filled from index ``to`` on.
    """
    step = np.uint64(neighbour)
    for k in range(count):
        i, o = np.uint64(cell) + np.uint64(k), np.uint64(to) + np.uint64(k)
        b, a = i - step, i + step
        # loaded before they are chosen from: a choice of address would be gathered
        here, ahead, behind = n[i], n[a], n[b]
        ahead, behind = ahead if h[a] > dry else here, behind if h[b] > dry else here
        out.c[o] = math.sqrt(beta[i] * h[i])
        h_i, h_b, h_a, t_i, t_a, t_b = h[i], h[b], h[a], t[i], t[a], t[b]
        t_a, t_b = t_a if h_a > dry else t_i, t_b if h_b > dry else t_i
        steepness = steepness_of(behind, ahead, slips(here, (behind, t_b), (ahead, t_a)))
        h_low, h_high = steps_to_faces(h_i - h_b, h_a - h_i, steepness)
        h_low = rear_step(h_i, h_b, 0.5) if at_rear(h_i, h_a, h_b, -here, steepness) else h_low
        h_high = rear_step(h_i, h_a, 0.5) if at_rear(h_i, h_b, h_a, here, steepness) else h_high
        n_low, n_high = steps_to_faces(here - behind, ahead - here, steepness)
        t_low, t_high = steps_to_faces(t_i - t_b, t_a - t_i, 2.0)
        mean, wave_a, wave_b, n_a, n_b = (h_i, here, t_i), beta[a] * h_a, beta[b] * h_b, n[a], n[b]
        # it moves to one of both faces
        more = lead(here, n_b, 1.0) if here > 0.0 else lead(here, n_a, -1.0)
        least = least_shown(h_i, here, more, wave_b if here > 0.0 else wave_a)
        out.h_low[o], out.n_low[o], out.t_low[o] = face_state(
            mean, (h_i + h_low, n_low, t_low), h_b, (h_a, n_a, wave_a), least, -1.0, dry
        )
        out.h_high[o], out.n_high[o], out.t_high[o] = face_state(
            mean, (h_i + h_high, n_high, t_high), h_a, (h_b, n_b, wave_b), least, 1.0, dry
        )
