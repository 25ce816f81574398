"""Values at the edges of cells on a surface: the lattice's reconstruction in the frames of the edges."""

from __future__ import annotations

import math

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.limiter import ALL, FRONT, LEAST
from solver.kernels.state import FaceValues
from solver.lattice.reconstruction import limited
from solver.surface.metric import EdgeFrames


@kernel(unaliased=True)
def edge_values(
    h: Array,
    u: Array,
    v: Array,
    g_n: Array,
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
    g_n : flat array
        Gravity normal to the bed, m s-2.
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
        lost = -(back + forth)
        slower = min(abs(ahead), abs(behind))
        steepness = 1.0 if slower < lost else 2.0
        out.c[o] = math.sqrt(g_n[i] * h_i)
        low, high = limited(h_i - h_b, h_a - h_i, steepness)
        more_a, more_b = n_a - high_n, low_n - n_b
        more_a, more_b = more_a if more_a > 0.0 else 0.0, more_b if more_b > 0.0 else 0.0
        led_a = (high_n >= 0.0) | ((n_a < 0.0) & (more_a * more_a <= 4.0 * (g_n[a] * h_a)))
        led_b = (low_n <= 0.0) | ((n_b > 0.0) & (more_b * more_b <= 4.0 * (g_n[b] * h_b)))
        low_depth, high_depth, least = h_i - low, h_i + high, LEAST * h_i
        low_depth = least if (low_n < 0.0) & (low_depth < least) else low_depth
        high_depth = least if (high_n > 0.0) & (high_depth < least) else high_depth
        out.h_low[o] = 0.0 if (h_b <= dry) & (h_i < FRONT * h_a) & led_a else low_depth
        out.h_high[o] = 0.0 if (h_a <= dry) & (h_i < FRONT * h_b) & led_b else high_depth
        low, high = limited(back, forth, steepness)
        low, high = low_n - low, high_n + high
        all_low = (low_depth > ALL * h_i) & (low < 0.0)
        all_high = (high_depth > ALL * h_i) & (high > 0.0)
        out.n_low[o], out.n_high[o] = low_n if all_low else low, high_n if all_high else high
        t_b, t_a = t_b if h_b > dry else low_t, t_a if h_a > dry else high_t
        low, high = limited(low_t - t_b, t_a - high_t, 2.0)
        out.t_low[o] = low_t - (0.0 if all_low else low)
        out.t_high[o] = high_t + (0.0 if all_high else high)
