"""Which cells on a surface take part in a step: what is dry, and what friction holds."""

from __future__ import annotations

import numpy as np

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.friction import below_yield, law_at, mean_drive, raised_rate
from solver.kernels.runge_kutta import less_moving, raised_by_fall
from solver.kernels.state import BELOW_YIELD, DRY, GHOSTS, Fields, Grid, Material, may_flow
from solver.lattice.spans import Spans, trim
from solver.lattice.status import bound_films
from solver.physics.resistance import Uniform
from solver.surface.levels import slopes_by_level
from solver.surface.metric import Metric
from solver.surface.pressure import Pressure, pushed, set_pressure, tilts_of, waves_over_edges


@kernel(inline=True)
def rests(
    h_x: float,
    h_y: float,
    h: float,
    slope: tuple[float, float, float],
    gravity: tuple[float, float, float],
    law: Uniform,
    pressure: Pressure | None,
    i: int,
) -> bool:
    """Whether friction balances gravity and a slope of depth in plan.

    Parameters
    ----------
    h_x, h_y : float
        Derivatives of depth in plan, dimensionless.
    h : float
        Depth there, m.
    slope : tuple
        p, r, q of `solver.surface.metric.Metric`.
    gravity : tuple
        Along e1 and e2 and normal to the bed, m s-2.
    law : named tuple
        Of basal friction.
    pressure, i
        Earth pressure, if it is not isotropic, and the cell.
    """
    p, r, q = slope
    g_1, g_2, g_n = gravity
    push_x, push_y = pushed(pressure, i, g_n, p * h_x, r * h_x + q * h_y)
    drive_x, drive_y = push_x - g_1, push_y - g_2
    held: bool = below_yield(law, drive_x, drive_y, h, g_n)
    return held


@kernel(inline=True)
def rests_at_edges(
    slopes: tuple[float, float, float, float],
    depths: tuple[float, float, float, float],
    h: float,
    slope: tuple[float, float, float],
    gravity: tuple[float, float, float],
    law: Uniform,
    pressure: Pressure | None,
    i: int,
) -> bool:
    """Whether friction holds a cell at each of its edges, with the mean slope in the other direction.

    Parameters
    ----------
    slopes : tuple
        Of depth in plan at the low and high edge along x and along y, dimensionless.
    depths : tuple
        At the same edges, m.
    h : float
        Depth of the cell, m.
    slope, gravity, law, pressure, i
        As of `rests`.
    """
    back_x, forth_x, back_y, forth_y = slopes
    h_w, h_e, h_s, h_n = depths
    mean_x = mean_drive(law, back_x, forth_x, h_w, h_e, h)
    mean_y = mean_drive(law, back_y, forth_y, h_s, h_n, h)
    held: bool = rests(back_x, mean_y, h_w, slope, gravity, law, pressure, i)
    held &= rests(forth_x, mean_y, h_e, slope, gravity, law, pressure, i)
    held &= rests(mean_x, back_y, h_s, slope, gravity, law, pressure, i)
    held &= rests(mean_x, forth_y, h_n, slope, gravity, law, pressure, i)
    return held


@kernel(unaliased=True)
def classify_row(
    now: Fields,
    static: Array,
    pressure: Pressure | None,
    metric: Metric,
    material: Material,
    grid: Grid,
    rate: Array,
    cell: int,
    column: int,
    count: int,
) -> None:
    """Set the status of a run of cells, and raise the wave rate of their columns.

    A cell is static if it is dry, or at rest where the driving acceleration is at most ``R(0, h)`` at
    each of its edges, with the mean slope of depth in the other direction.
    """
    set_pressure(now, pressure, metric, material, grid, cell, count)
    h, u, v = now
    dry, one, row = material.dry, np.uint64(1), np.uint64(grid.stride)
    over = 1.0 / grid.dx
    x, y = metric.x_edges, metric.y_edges
    for k in range(count):
        i, c = np.uint64(cell) + np.uint64(k), np.uint64(column) + np.uint64(k)
        w, e, s, n = i - one, i + one, i - row, i + row
        h_i, g_n, law = h[i], metric.g_n[i], law_at(material.law, i)
        slope, gravity = (metric.p[i], metric.r[i], metric.q[i]), (metric.g_1[i], metric.g_2[i], g_n)
        wet = may_flow(h_i, u[i], v[i], dry)
        back_x, forth_x = (h_i - h[w]) * over, (h[e] - h_i) * over
        back_y, forth_y = (h_i - h[s]) * over, (h[n] - h_i) * over
        h_w, h_e, h_s, h_n = 0.5 * (h_i + h[w]), 0.5 * (h_i + h[e]), 0.5 * (h_i + h[s]), 0.5 * (h_i + h[n])
        slopes, depths = (back_x, forth_x, back_y, forth_y), (h_w, h_e, h_s, h_n)
        u_i, v_i = u[i], v[i]
        held = (u_i * u_i + v_i * v_i) == 0.0
        held &= rests_at_edges(slopes, depths, h_i, slope, gravity, law, pressure, i)
        stopped = BELOW_YIELD if held else 0.0
        static[i] = stopped if wet else DRY
        wave_x, wave_y = waves_over_edges(pressure, i, g_n, h_i)
        to_e, to_w = abs(x.c_low[i] * u_i + x.s_low[i] * v_i), abs(x.c_high[w] * u_i + x.s_high[w] * v_i)
        to_n, to_s = abs(y.c_low[i] * u_i + y.s_low[i] * v_i), abs(y.c_high[s] * u_i + y.s_high[s] * v_i)
        through_x = x.length[i] * (to_e + wave_x) + x.length[w] * (to_w + wave_x)
        through_y = y.length[i] * (to_n + wave_y) + y.length[s] * (to_s + wave_y)
        this = 0.5 * metric.per_area[i] * (through_x + through_y)
        carried = x.length[i] * to_e + x.length[w] * to_w + y.length[i] * to_n + y.length[s] * to_s
        carried *= 0.5 * metric.per_area[i]
        # what is held does not start in this step
        falling = metric.falling[i] if stopped == 0.0 else 0.0
        this = raised_by_fall(this, carried, falling)
        this = raised_rate(law, this, h_i, g_n, dry)
        this = this if wet else 0.0
        rate[c] = this if this > rate[c] else rate[c]


@kernel()
def hold_by_level(
    now: Fields,
    static: Array,
    pressure: Pressure | None,
    metric: Metric,
    material: Material,
    grid: Grid,
    cell: int,
    count: int,
) -> None:
    """Hold those cells of a run, too, that friction holds by the slopes of their surface (S14)."""
    h, u, v = now
    tilt_x, tilt_y = tilts_of(pressure, metric)
    m, over = grid.stride, 1.0 / grid.dx
    for i in range(cell, cell + count):
        if static[i] != 0.0 or u[i] != 0.0 or v[i] != 0.0:
            continue
        law = law_at(material.law, i)
        slope = metric.p[i], metric.r[i], metric.q[i]
        gravity = metric.g_1[i], metric.g_2[i], metric.g_n[i]
        back_x, forth_x = slopes_by_level(h, tilt_x, i, 1, over)
        back_y, forth_y = slopes_by_level(h, tilt_y, i, m, over)
        h_w, h_e = 0.5 * (h[i] + h[i - 1]), 0.5 * (h[i] + h[i + 1])
        h_s, h_n = 0.5 * (h[i] + h[i - m]), 0.5 * (h[i] + h[i + m])
        slopes, depths = (back_x, forth_x, back_y, forth_y), (h_w, h_e, h_s, h_n)
        if rests_at_edges(slopes, depths, h[i], slope, gravity, law, pressure, i):
            static[i] = BELOW_YIELD


@kernel()
def classify_surface(
    now: Fields,
    static: Array,
    pressure: Pressure | None,
    metric: Metric,
    material: Material,
    grid: Grid,
    spans: Spans,
) -> float:
    """Set the status of every cell that may be wet, trim the wet spans, find the moving ones.

    Returns
    -------
    float
        Largest sum over edges of ``length (|u_n| + c) / (2 area)`` in a wet cell, or what gravity needs, s-1.
    """
    m = grid.stride
    spans.rate[:] = 0.0
    for j in range(GHOSTS, grid.rows - GHOSTS):
        lo, hi = spans.wet[0, j], spans.wet[1, j]
        spans.moving[0, j] = spans.moving[1, j] = 0
        if lo >= hi:
            continue
        about = metric, material, grid, spans.rate
        bound_films(now, material.dry, m, j * m + lo, hi - lo)
        classify_row(now, static, pressure, *about, j * m + lo, lo, hi - lo)
        hold_by_level(now, static, pressure, metric, material, grid, j * m + lo, hi - lo)
        trim(spans, j, static, j * m)
    fastest = 0.0
    for c in range(m):
        fastest = max(fastest, spans.rate[c])
    return fastest


@kernel()
def moving_volume_exceeds(
    now: Fields, static: Array, spans: Spans, metric: Metric, grid: Grid, volume: float, started: bool
) -> bool:
    """Whether cells that are not still hold more than a volume, m3, as on a lattice."""
    m, moves, left = grid.stride, not started, volume
    for j in range(GHOSTS, grid.rows - GHOSTS):
        for i in range(j * m + spans.moving[0, j], j * m + spans.moving[1, j]):
            held = now.h[i] / metric.per_area[i]
            left, moves = less_moving(left, moves, static[i], held, now.u[i], now.v[i])
            if moves and left < 0.0:
                return True
    return False
