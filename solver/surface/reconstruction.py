"""Values at the edges of cells on a surface: the lattice's reconstruction in the frames of the edges."""

from __future__ import annotations

import math

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.limiter import face_state, lead, least_shown, steepness_of
from solver.kernels.state import FaceValues
from solver.lattice.reconstruction import steps_to_faces
from solver.surface.levels import is_level, steps_of_surface, with_level
from solver.surface.metric import EdgeFrames


@kernel(unaliased=True)
def edge_values(
    h: Array,
    u: Array,
    v: Array,
    beta: Array,
    tilt: Array,
    edges: EdgeFrames,
    cell: int,
    neighbour: int,
    count: int,
    dry: float,
    out: FaceValues,
    to: int,
) -> None:
    """Reconstruct a run of cells at their low and high edges along one direction.

    The rules are those of `solver.lattice.reconstruction.face_values`. A cell differs from the one behind it
    in the frame of the edge behind, and from the one ahead in the frame of the edge ahead.

    Parameters
    ----------
    h, u, v : flat arrays
        Depth (m) and velocity in the frames of the cells (m s-1).
    beta : flat array
        Pressure on the edges, g_n K, m s-2.
    tilt : flat array
        Depth that a level surface gains from the middle of a cell to its high edge, m.
    edges : EdgeFrames
        Of the direction.
    cell, neighbour, count, dry, out, to
        As for `face_values`.
    """
    _, c_low, s_low, c_high, s_high = edges
    step = np.uint64(neighbour)
    for k in range(count):
        i, o = np.uint64(cell) + np.uint64(k), np.uint64(to) + np.uint64(k)
        b, a = i - step, i + step
        h_b, h_i, h_a = h[b], h[i], h[a]
        u_b, u_i, u_a, v_b, v_i, v_a = u[b], u[i], u[a], v[b], v[i], v[a]
        # behind and here in the frame of the edge behind, here and ahead in that of the edge ahead
        c_b, s_b, c_h, s_h = c_low[b], s_low[b], c_high[b], s_high[b]
        n_b, t_b = c_b * u_b + s_b * v_b, c_b * v_b - s_b * u_b
        low_n, low_t = c_h * u_i + s_h * v_i, c_h * v_i - s_h * u_i
        c_l, s_l, c_a, s_a = c_low[i], s_low[i], c_high[i], s_high[i]
        high_n, high_t = c_l * u_i + s_l * v_i, c_l * v_i - s_l * u_i
        n_a, t_a = c_a * u_a + s_a * v_a, c_a * v_a - s_a * u_a
        ahead, behind = n_a if h_a > dry else high_n, n_b if h_b > dry else low_n
        back, forth = low_n - behind, ahead - high_n
        mean = 0.5 * (low_n + high_n)
        steepness = steepness_of(mean - back, mean + forth)
        wave = beta[i] * h_i
        out.c[o] = math.sqrt(wave)
        h_low, h_high = steps_to_faces(h_i - h_b, h_a - h_i, steepness)
        n_low, n_high = steps_to_faces(back, forth, steepness)
        t_back = low_t - (t_b if h_b > dry else low_t)
        t_forth = (t_a if h_a > dry else high_t) - high_t
        t_low, t_high = steps_to_faces(t_back, t_forth, 2.0)
        depths = h_b, h_i, h_a
        tilts = tilt[b], tilt[i], tilt[a]
        level_low, level_high, surface_back, surface_forth = steps_of_surface(depths, tilts)
        share = 1.0 - mean * mean / (wave + 1e-300)
        share = share if (share > 0.0) & is_level(depths, surface_back, surface_forth) else 0.0
        down, up = steps_to_faces(surface_back, surface_forth, 2.0)
        # what is ahead, in the frame of the edge behind, and what is behind in that of the edge ahead
        led_by = h_a, n_a + (low_n - high_n), beta[a] * h_a
        least = least_shown(h_i, low_n, lead(low_n, led_by[1], -1.0), led_by[2])
        cell_low, cell_high = (h_i, low_n, low_t), (h_i, high_n, high_t)
        shown = face_state(cell_low, (h_i + h_low, n_low, t_low), h_b, led_by, least, -1.0, dry)
        out.h_low[o], out.n_low[o], out.t_low[o] = with_level(
            shown, cell_low, level_low, down, share, h_b, -1.0, dry
        )
        led_by = h_b, n_b + (high_n - low_n), beta[b] * h_b
        least = least_shown(h_i, high_n, lead(high_n, led_by[1], 1.0), led_by[2])
        shown = face_state(cell_high, (h_i + h_high, n_high, t_high), h_a, led_by, least, 1.0, dry)
        out.h_high[o], out.n_high[o], out.t_high[o] = with_level(
            shown, cell_high, level_high, up, share, h_a, 1.0, dry
        )
