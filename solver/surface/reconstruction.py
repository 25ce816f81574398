"""Values at the edges of cells on a surface: the lattice's reconstruction in the frames of the edges."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.limiter import at_rear, face_state, lead, least_shown, rear_step, slips, steepness_of
from solver.kernels.state import LANES, FaceValues
from solver.lattice.reconstruction import steps_to_faces
from solver.surface.levels import is_level, steps_of_surface, with_level
from solver.surface.metric import EdgeFrames

# Cells of a run that are looked at together for a level surface, which few have: whole vectors.
TOGETHER = 2 * LANES


class Levels(NamedTuple):
    """What a level surface would show at the edges of cells looked at together, arrays of shape (TOGETHER,).

    Attributes
    ----------
    low, high
        Depths at both edges, m.
    back, forth
        Steps of the surface from the cell behind and to the one ahead, m.
    square
        Of the velocity where the surface counts, elsewhere of the speed of waves, m2 s-2.
    """

    low: Array
    high: Array
    back: Array
    forth: Array
    square: Array


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
    levels: Levels,
    out: FaceValues,
    to: int,
) -> None:
    """Reconstruct a run of cells at their low and high edges along one direction.

    The rules are those of `solver.lattice.reconstruction.face_values`. A cell differs from the one behind it
    in the frame of the edge behind, and from the one ahead in the frame of the edge ahead.

    A level surface counts only where the flow is slower than waves, so that most cells are not looked at for
    one; and nothing is computed where all is dry.

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
    levels : Levels
        Scratch.
    """
    _, c_low, s_low, c_high, s_high = edges
    step = np.uint64(neighbour)
    for start in range(0, count, TOGETHER):
        stop = start + TOGETHER if start + TOGETHER < count else count
        wet = 0
        for k in range(start, stop):
            i = np.uint64(cell) + np.uint64(k)
            wet += 1 if (h[i - step] + h[i]) + h[i + step] > 0.0 else 0
        if wet == 0:
            for k in range(start, stop):
                o = np.uint64(to) + np.uint64(k)
                out.h_low[o] = out.n_low[o] = out.t_low[o] = out.c[o] = 0.0
                out.h_high[o] = out.n_high[o] = out.t_high[o] = 0.0
            continue
        slow = 0
        for k in range(start, stop):
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
            beside = (behind, t_b if h_b > dry else low_t), (ahead, t_a if h_a > dry else high_t)
            steepness = steepness_of(mean - back, mean + forth, slips(mean, *beside))
            wave = beta[i] * h_i
            slow += 1 if (mean * mean < wave + 1e-300) & (h_i > 0.0) else 0
            out.c[o] = math.sqrt(wave)
            h_low, h_high = steps_to_faces(h_i - h_b, h_a - h_i, steepness)
            h_low = rear_step(h_i, h_b, 0.5) if at_rear(h_i, h_a, h_b, -low_n, steepness) else h_low
            h_high = rear_step(h_i, h_a, 0.5) if at_rear(h_i, h_b, h_a, high_n, steepness) else h_high
            n_low, n_high = steps_to_faces(back, forth, steepness)
            t_back = low_t - (t_b if h_b > dry else low_t)
            t_forth = (t_a if h_a > dry else high_t) - high_t
            t_low, t_high = steps_to_faces(t_back, t_forth, 2.0)
            # what is ahead, in the frame of the edge behind, and what is behind in that of the edge ahead
            led_by = h_a, n_a + (low_n - high_n), beta[a] * h_a
            least = least_shown(h_i, low_n, lead(low_n, led_by[1], -1.0), led_by[2])
            out.h_low[o], out.n_low[o], out.t_low[o] = face_state(
                (h_i, low_n, low_t), (h_i + h_low, n_low, t_low), h_b, led_by, least, -1.0, dry
            )
            led_by = h_b, n_b + (high_n - low_n), beta[b] * h_b
            least = least_shown(h_i, high_n, lead(high_n, led_by[1], 1.0), led_by[2])
            out.h_high[o], out.n_high[o], out.t_high[o] = face_state(
                (h_i, high_n, high_t), (h_i + h_high, n_high, t_high), h_a, led_by, least, 1.0, dry
            )
        if slow == 0:
            continue
        some = 0
        for k in range(start, stop):
            i, o = np.uint64(cell) + np.uint64(k), np.uint64(k - start)
            b, a = i - step, i + step
            depths = h[b], h[i], h[a]
            low, high, back, forth = steps_of_surface(depths, (tilt[b], tilt[i], tilt[a]))
            mean = 0.5 * ((c_high[b] * u[i] + s_high[b] * v[i]) + (c_low[i] * u[i] + s_low[i] * v[i]))
            wave = beta[i] * h[i] + 1e-300
            levels.low[o], levels.high[o], levels.back[o], levels.forth[o] = low, high, back, forth
            square = mean * mean
            square = square if (square < wave) & is_level(depths, back, forth) else wave
            levels.square[o] = square
            # counted, since a loop that only asks whether there is one does not vectorise
            some += 1 if square < wave else 0
        if some == 0:
            continue
        for k in range(start, stop):
            i, o, c = np.uint64(cell) + np.uint64(k), np.uint64(to) + np.uint64(k), np.uint64(k - start)
            b, a = i - step, i + step
            h_b, h_i, h_a, u_i, v_i = h[b], h[i], h[a], u[i], v[i]
            c_h, s_h, c_l, s_l = c_high[b], s_high[b], c_low[i], s_low[i]
            share = 1.0 - levels.square[c] / (beta[i] * h[i] + 1e-300)
            down, up = steps_to_faces(levels.back[c], levels.forth[c], 2.0)
            shown, mean = (
                (out.h_low[o], out.n_low[o], out.t_low[o]),
                (h_i, c_h * u_i + s_h * v_i, c_h * v_i - s_h * u_i),
            )
            out.h_low[o], out.n_low[o], out.t_low[o] = with_level(
                shown, mean, levels.low[c], down, share, h_b, -1.0, dry
            )
            shown, mean = (
                (out.h_high[o], out.n_high[o], out.t_high[o]),
                (h_i, c_l * u_i + s_l * v_i, c_l * v_i - s_l * u_i),
            )
            out.h_high[o], out.n_high[o], out.t_high[o] = with_level(
                shown, mean, levels.high[c], up, share, h_a, 1.0, dry
            )
